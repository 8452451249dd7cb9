// What is closed: doors, rooms and areas of each floor, and links between floors.

import { element } from "./route.js";
import { t } from "./texts.js";

const NOTHING = { doors: [], rooms: [], polygons: [] };
const SAME = 1.5; // cells within which a door or a room is the one that was there before

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

  // Where doors and rooms of this floor are closed, to be crossed out.
  get marks() {
    const closed = this.on(this.page.floors.at);
    const { rooms, doors } = this.page.map.rooms;
    return [...doors.filter((door) => closed.doors.includes(door.number)), ...rooms.filter((room) => closed.rooms.includes(room.name))].map((each) => each.at);
  }

  // What is shaded: drawn areas, and rooms whose outlines are there, each a list of rings.
  get areas() {
    const closed = this.on(this.page.floors.at);
    return [...closed.polygons.map((ring) => [ring]), ...closed.rooms.map((name) => this.page.names.ringsOf(name))];
  }

  get links() {
    return this.list.filter((each) => each.kind === "links").map((each) => each.what);
  }

  // What a query sends, of all floors.
  get asked() {
    const numbers = [...new Set(this.list.filter((each) => each.kind !== "links").map((each) => each.floor))];
    return { links: this.links, floors: numbers.map((floor) => ({ floor, ...this.on(floor) })) };
  }

  // Close something, or open it again.
  toggle(kind, what) {
    const floor = kind === "links" ? null : this.page.floors.at;
    const at = this.list.findIndex((each) => each.kind === kind && each.floor === floor && each.what === what);
    if (kind === "rooms") this.page.names.outlined();
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

  // Follow doors and rooms of a floor to their new numbers and names, by where they are, and
  // return what is there no more, as it was called.
  follow(floor, before, after) {
    const key = { doors: "number", rooms: "name" };
    const lost = [];
    const followed = (each) => {
      if (each.floor !== floor || !(each.kind in key)) return [each];
      const [name, all] = [key[each.kind], after[each.kind]];
      const old = before[each.kind].find((one) => one[name] === each.what);
      const same = each.kind === "rooms" && all.find((one) => one.name === each.what);
      const found = same || (old && all.find((one) => one.area_m2 === old.area_m2 && Math.hypot(one.at[0] - old.at[0], one.at[1] - old.at[1]) < SAME));
      if (!found) lost.push(each.kind === "doors" ? t("door-n", each.what) : each.what);
      return found ? [{ ...each, what: found[name] }] : [];
    };
    this.list = this.list.flatMap(followed);
    this.#before = [];
    this.show();
    return lost;
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
    if (this.byId("area-start").ariaPressed === "true") document.querySelector("input[value=close]").checked = true;
    this.byId("area-start").ariaPressed = "false";
    this.page.scene.draw();
    return isKept && corners.length >= 3 ? this.toggle("polygons", corners) : null;
  }

  show() {
    const { floors } = this.page;
    const areas = this.list.filter((each) => each.kind === "polygons");
    const names = { doors: ({ what }) => t("door-n", what), polygons: (each) => t("area-n", areas.indexOf(each) + 1) };
    const items = this.list.map((each, at) => {
      const what = names[each.kind]?.(each) ?? each.what;
      const text = (each.floor !== null && floors.named(each.floor, (name) => t("in-floor", what, name))) || what;
      const open = () => this.#become(this.list.toSpliced(at, 1));
      return element("li", {}, text, element("button", { onclick: open, ariaLabel: t("open-it", text) }, t("open")));
    });
    this.byId("closed").replaceChildren(...items);
    this.byId("close-undo").disabled = !this.#before.length;
    this.byId("close-clear").disabled = !this.list.length;
  }
}
