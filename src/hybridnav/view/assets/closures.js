// What is closed: doors, rooms and areas of each floor, and links between floors.

import { element } from "./route.js";

const NOTHING = { doors: [], rooms: [], polygons: [] };

export class Closures {
  list = []; // { kind, floor, what }; kind is doors, rooms, polygons or links
  draft = []; // corners of an area that is being drawn
  #before = []; // lists to go back to

  constructor(page) {
    this.page = page;
    this.byId = (id) => document.getElementById(id);
  }

  // What is closed on a floor, by kind.
  on(floor) {
    const found = structuredClone(NOTHING);
    for (const each of this.list) if (each.floor === floor && each.kind in found) found[each.kind].push(each.what);
    return found;
  }

  get links() {
    return this.list.filter((each) => each.kind === "links").map((each) => each.what);
  }

  // What a query sends: of a map, or of all floors of a building.
  get asked() {
    if (!this.page.floors.isBuilding) return this.on(0);
    const numbers = [...new Set(this.list.filter((each) => each.kind !== "links").map((each) => each.floor))];
    return { links: this.links, floors: numbers.map((floor) => ({ floor, ...this.on(floor) })) };
  }

  get nothing() {
    return this.page.floors.isBuilding ? { links: [], floors: [] } : NOTHING;
  }

  // Close something, or open it again.
  toggle(kind, what) {
    const floor = kind === "links" ? null : this.page.floors.at;
    const at = this.list.findIndex((each) => each.kind === kind && each.floor === floor && each.what === what);
    return this.#become(at < 0 ? [...this.list, { kind, floor, what }] : this.list.toSpliced(at, 1));
  }

  openAll() {
    return this.list.length ? this.#become([]) : null;
  }

  undo() {
    if (!this.#before.length) return null;
    this.list = this.#before.pop();
    return this.#changed();
  }

  #become(list) {
    this.#before.push(this.list);
    this.list = list;
    return this.#changed();
  }

  #changed() {
    this.show();
    this.page.scene.draw();
    return this.page.routes.plan();
  }

  // Drop what no room or door of the floor stands behind any more.
  forget(rooms) {
    const { at } = this.page.floors;
    const known = { doors: rooms.doors.map((door) => door.number), rooms: rooms.rooms.map((room) => room.name) };
    this.list = this.list.filter((each) => each.floor !== at || !(each.kind in known) || known[each.kind].includes(each.what));
    this.#before = [];
    this.show();
  }

  addCorner(point) {
    this.draft.push(point);
    this.byId("area-done").hidden = this.draft.length < 3;
    this.page.scene.draw();
  }

  endArea(isKept) {
    const corners = this.draft;
    this.draft = [];
    this.byId("area-done").hidden = true;
    this.page.scene.draw();
    return isKept && corners.length >= 3 ? this.toggle("polygons", corners) : null;
  }

  show() {
    const { floors } = this.page;
    const areas = this.list.filter((each) => each.kind === "polygons");
    const names = { doors: ({ what }) => `door ${what}`, polygons: (each) => `area ${areas.indexOf(each) + 1}` };
    const items = this.list.map((each, at) => {
      const where = floors.isBuilding && each.floor !== null ? `, floor ${floors.nameOf(each.floor)}` : "";
      const text = (names[each.kind]?.(each) ?? each.what) + where;
      const open = () => this.#become(this.list.toSpliced(at, 1));
      return element("li", {}, text, element("button", { onclick: open, ariaLabel: `Open ${text}` }, "Open"));
    });
    this.byId("closed").replaceChildren(...items);
    this.byId("close-undo").disabled = !this.#before.length;
    this.byId("close-clear").disabled = !this.list.length;
  }
}
