// Rooms: their names, unions, cuts and corners, and the file that they are saved in.

import { element } from "./route.js";
import { said, settings, t } from "./texts.js";

const NEAR = 12; // pixels within which a corner is meant

export class Names {
  chosen = "";
  rings = []; // outlines of all rooms, in the order of the rooms
  tool = ""; // "split", "corners", or none
  line = []; // points of a cut
  lifted = null; // a corner that the keyboard has taken up
  #isReplacing = false;
  #turn = Promise.resolve(); // changes wait for the one before: it makes the version that they change

  constructor(page) {
    this.page = page;
    this.byId = (id) => document.getElementById(id);
  }

  get rooms() {
    return this.page.map.rooms;
  }

  // Rooms and doors in lists and on the map: those that people look for, or all; for staff the
  // doors that lead somewhere, and those of the way.
  get shown() {
    const { rooms, doors } = this.rooms;
    const isShown = ({ listed, name }) => listed || name === this.chosen || this.byId("show-all").checked;
    const isDoor = settings.face === "staff" ? (door) => door.leads || this.isTold(door) : isShown;
    return { rooms: rooms.filter(isShown), doors: doors.filter(isDoor) };
  }

  // Whether the words of the way are about a door of the floor that is shown.
  isTold(door) {
    return this.page.routes.lines.some((line) => line.floor === this.page.floors.at && line.door === door.number);
  }

  get ownRings() {
    return this.ringsOf(this.chosen);
  }

  ringsOf(name) {
    return this.rings[this.rooms.rooms.findIndex((room) => room.name === name)] ?? [];
  }

  // Fetch the outlines of the rooms unless they are there.
  async outlined() {
    if (this.rings.length || !this.page.link.isLive) return;
    const { rings, version } = await this.page.link.get("outlines");
    if (version !== this.rooms.version) return; // of other rooms than those that are shown
    this.rings = rings;
    this.page.scene.draw();
  }

  async choose(name, typed = name) {
    this.chosen = name;
    this.byId("room").value = name;
    this.byId("room-name").value = typed;
    this.lifted = null;
    this.show();
    if (name) await this.outlined();
  }

  async clicked(point) {
    if (this.tool === "split" && this.chosen) {
      this.line.push(point);
      if (this.line.length === 2) await this.#split();
      else this.page.say(t("other-end"));
      this.page.scene.draw();
      return;
    }
    const { room } = await this.page.link.post("at", { point });
    const outlined = this.choose(room ?? "");
    if (room && !matchMedia("(pointer: coarse)").matches) { // the keys of a phone hide the map
      this.byId("room-name").focus();
      this.byId("room-name").select();
    }
    await outlined;
  }

  use(tool) {
    this.tool = this.tool === tool ? "" : tool;
    this.line = [];
    this.lifted = null;
    this.show();
    if (this.tool && !this.chosen) this.page.say(t("room-first"), true);
    else if (this.tool === "split") this.page.say(t("two-points"));
    else if (this.tool === "corners") this.page.say(t("drag-corner"));
  }

  grab(at) {
    if (this.tool !== "corners" || !this.chosen) return null;
    for (const corner of this.ownRings.flat()) {
      const [x, y] = this.page.scene.toScreen(corner);
      if (Math.hypot(x - at[0], y - at[1]) < NEAR) return { kind: "corner", corner, from: [...corner] };
    }
    return null;
  }

  drag(held, point) {
    held.corner[0] = point[0];
    held.corner[1] = point[1];
    this.page.scene.draw();
  }

  drop(held, point) {
    return this.edit({ op: "move", room: this.chosen, corner: held.from, to: point });
  }

  // Begin anew on another floor.
  reset() {
    Object.assign(this, { chosen: "", rings: [], tool: "", line: [], lifted: null });
    this.#isReplacing = false;
    this.byId("room-name").value = "";
    this.list();
    this.show();
  }

  // --- changes

  edit(change, after = this.chosen) {
    return this.#change("edit", { change }, after);
  }

  // Ask for a change of the floor that is shown now, even if another one is when its turn comes.
  #change(name, more, after) {
    const { map, link, floors } = this.page;
    const [base, floor, about] = [link.base, floors.at, this.chosen];
    return this.#inTurn(async () => {
      try {
        const rooms = await link.post(name, { version: map.rooms.version, ...more }, base);
        await this.#changed(map, floor, rooms, this.chosen === about ? after : this.chosen, true);
      } catch (problem) {
        await this.#refused(problem);
      }
    });
  }

  #inTurn(work) {
    this.#turn = this.#turn.then(work, work);
    return this.#turn;
  }

  rename() {
    const name = this.byId("room-name").value.trim();
    if (!this.chosen || !name) {
      this.page.say(t("name-first"), true);
      return null;
    }
    return this.edit({ op: "rename", room: this.chosen, name }, name);
  }

  merge() {
    const other = this.byId("other-room").value;
    if (!this.chosen || !other) {
      this.page.say(t("two-rooms"), true);
      return null;
    }
    return this.edit({ op: "merge", room: this.chosen, other });
  }

  #split() {
    const taken = new Set(this.rooms.rooms.map((room) => room.name));
    let number = 2;
    while (taken.has(`${this.chosen} ${number}`)) number += 1;
    const line = this.line;
    this.use("");
    return this.edit({ op: "split", room: this.chosen, line, name: `${this.chosen} ${number}` });
  }

  undo() {
    return this.#change("undo", {}, this.chosen);
  }

  save() {
    const { map, link } = this.page;
    const { base } = link;
    this.byId("save").textContent = t("saving");
    return this.#inTurn(async () => {
      try {
        map.rooms = await link.post("save", { version: map.rooms.version, replace: this.#isReplacing }, base);
        this.#isReplacing = false;
        this.show();
        this.page.say(said(map.rooms.notice), false, true);
      } catch (problem) {
        this.#isReplacing = problem.code === 409;
        await this.#refused(problem);
      }
    });
  }

  async #changed(map, floor, rooms, chosen, isOwn = false) {
    const before = map.rooms;
    map.rooms = rooms;
    const lost = await this.page.closures.follow(floor, before, rooms, isOwn);
    if (map !== this.page.map) return; // another floor is shown meanwhile
    this.rings = [];
    this.page.scene.version = rooms.version;
    this.list();
    const typed = this.byId("room-name").value;
    const isTyping = typed !== this.chosen; // a name that must not be lost meanwhile
    if (rooms.rooms.some((room) => room.name === chosen)) await this.choose(chosen, isTyping ? typed : chosen);
    else await this.choose("");
    if (this.page.closures.all.length) await this.outlined();
    await this.page.changed();
    if (lost.length) this.page.say(t("gone", lost.join(", ")), true);
  }

  async #refused(problem) {
    this.rings = [];
    await this.refresh();
    this.page.say(problem.message, true);
    if (this.chosen) await this.outlined().catch(() => {}); // the message has said what is wrong
  }

  // Take over what another page has changed, after the own changes.
  follow() {
    return this.#inTurn(() => this.refresh());
  }

  async refresh() {
    const { map, floors } = this.page;
    const floor = floors.at;
    try {
      const rooms = await this.page.link.get("rooms");
      if (rooms.version !== map.rooms.version) await this.#changed(map, floor, rooms, this.chosen);
      else map.rooms = rooms; // another page may have saved them
      this.show();
    } catch (problem) {
      this.page.say(problem.message, true);
    }
  }

  // --- the panel

  list() {
    const { rooms, doors: shown } = this.shown;
    const names = rooms.map((room) => room.name);
    const options = (first, values, text = (v) => v) => [
      element("option", { value: "" }, first),
      ...values.map((value) => element("option", { value }, text(value))),
    ];
    this.byId("room").replaceChildren(...options(t("choose"), names));
    this.byId("other-room").replaceChildren(...options(t("choose"), names));
    this.byId("close-room").replaceChildren(...options(t("choose"), names));
    const doors = shown.map((door) => door.number);
    const beside = new Map(shown.map((door) => [door.number, door.rooms]));
    const text = (n) => t("door-between", n, ...beside.get(n).map((room) => room ?? t("no-room")));
    this.byId("close-door").replaceChildren(...options(t("choose"), doors, text));
    this.byId("room").value = this.chosen;
  }

  show() {
    for (const tool of ["split", "corners"]) this.byId(tool).ariaPressed = String(this.tool === tool);
    for (const id of ["split", "corners", "merge", "rename-done"]) this.byId(id).disabled = !this.chosen;
    const { unsaved, notice } = this.rooms;
    const count = t(unsaved === 1 ? "unsaved-1" : "unsaved-n", unsaved);
    this.byId("unsaved").textContent = [unsaved ? count : "", said(notice)].filter(Boolean).join("; ");
    this.byId("no-file").textContent = said(this.page.map.no_file ?? "");
    this.byId("names-undo").disabled = !unsaved;
    this.byId("save").disabled = !this.page.map.can_save;
    this.byId("save").textContent = this.page.map.file ? t("save-file", this.page.map.file) : t("save");
    this.byId("save").classList.toggle("primary", Boolean(unsaved));
    this.page.scene.draw();
  }
}
