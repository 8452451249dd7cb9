// Rooms: their names, unions, cuts and corners, and the file that they are saved in.

import { element } from "./route.js";

const NEAR = 12; // pixels within which a corner is meant

export class Names {
  chosen = "";
  rings = []; // outlines of all rooms, in the order of the rooms
  tool = ""; // "split", "corners", or none
  line = []; // points of a cut
  #isReplacing = false;

  constructor(page) {
    this.page = page;
    this.byId = (id) => document.getElementById(id);
  }

  get rooms() {
    return this.page.map.rooms;
  }

  get ownRings() {
    return this.rings[this.rooms.rooms.findIndex((room) => room.name === this.chosen)] ?? [];
  }

  async choose(name) {
    this.chosen = name;
    this.byId("room").value = name;
    this.byId("room-name").value = name;
    this.show();
    if (name && !this.rings.length && this.page.link.isLive) {
      this.rings = (await this.page.link.get("outlines")).rings;
      this.page.scene.draw();
    }
  }

  async clicked(point) {
    if (this.tool === "split" && this.chosen) {
      this.line.push(point);
      if (this.line.length === 2) await this.#split();
      this.page.scene.draw();
      return;
    }
    const { room } = await this.page.link.post("at", { point });
    await this.choose(room ?? "");
    if (room) this.byId("room-name").select();
  }

  use(tool) {
    this.tool = this.tool === tool ? "" : tool;
    this.line = [];
    this.show();
    if (this.tool && !this.chosen) this.page.say("Choose a room first", true);
    else if (this.tool === "split") this.page.say("Click two points of the line");
    else if (this.tool === "corners") this.page.say("Drag a corner of the outline");
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
    Object.assign(this, { chosen: "", rings: [], tool: "", line: [] });
    this.#isReplacing = false;
    this.byId("room-name").value = "";
    this.list();
    this.show();
  }

  // --- changes

  async edit(change, after = this.chosen) {
    try {
      await this.#changed(await this.page.link.post("edit", { version: this.rooms.version, change }), after);
    } catch (problem) {
      await this.#refused(problem);
    }
  }

  rename() {
    const name = this.byId("room-name").value.trim();
    if (!this.chosen || !name) {
      this.page.say("Choose a room and type its name", true);
      return null;
    }
    return this.edit({ op: "rename", room: this.chosen, name }, name);
  }

  merge() {
    const other = this.byId("other-room").value;
    if (!this.chosen || !other) {
      this.page.say("Choose two rooms that touch", true);
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

  async undo() {
    try {
      await this.#changed(await this.page.link.post("undo", { version: this.rooms.version }), this.chosen);
    } catch (problem) {
      await this.#refused(problem);
    }
  }

  async save() {
    try {
      const asked = { version: this.rooms.version, replace: this.#isReplacing };
      this.page.map.rooms = await this.page.link.post("save", asked);
      this.#isReplacing = false;
      this.show();
    } catch (problem) {
      this.#isReplacing = problem.code === 409;
      await this.#refused(problem);
    }
  }

  async #changed(rooms, chosen) {
    this.page.map.rooms = rooms;
    this.rings = [];
    this.page.scene.version = rooms.version;
    this.page.closures.forget(rooms);
    this.list();
    await this.choose(rooms.rooms.some((room) => room.name === chosen) ? chosen : "");
    await this.page.changed();
  }

  async #refused(problem) {
    this.rings = [];
    await this.refresh();
    if (this.chosen) await this.choose(this.chosen);
    this.page.say(problem.message, true);
  }

  // Take over what another page has changed.
  async refresh() {
    try {
      const rooms = await this.page.link.get("rooms");
      if (rooms.version !== this.rooms.version) await this.#changed(rooms, this.chosen);
    } catch (problem) {
      this.page.say(problem.message, true);
    }
  }

  // --- the panel

  list() {
    const names = this.rooms.rooms.map((room) => room.name);
    const options = (first, values, text = (v) => v) => [
      element("option", { value: "" }, first),
      ...values.map((value) => element("option", { value }, text(value))),
    ];
    this.byId("room").replaceChildren(...options("choose…", names));
    this.byId("other-room").replaceChildren(...options("choose…", names));
    this.byId("close-room").replaceChildren(...options("choose…", names));
    const doors = this.rooms.doors.map((door) => door.number);
    const beside = new Map(this.rooms.doors.map((door) => [door.number, door.rooms]));
    const text = (n) => `${n}: ${beside.get(n).map((room) => room ?? "no room").join(" – ")}`;
    this.byId("close-door").replaceChildren(...options("choose…", doors, text));
    this.byId("room").value = this.chosen;
  }

  show() {
    for (const tool of ["split", "corners"]) this.byId(tool).ariaPressed = String(this.tool === tool);
    for (const id of ["split", "corners", "merge"]) this.byId(id).disabled = !this.chosen;
    const { unsaved, notice } = this.rooms;
    const count = unsaved === 1 ? "1 change is not saved" : `${unsaved} changes are not saved`;
    const isLost = unsaved && !this.page.map.can_save && this.page.floors.isBuilding;
    const advice = isLost ? "to save them, give this floor rooms: FILE in the file of the building, inside its folder" : "";
    this.byId("unsaved").textContent = [unsaved ? count : "", notice, advice].filter(Boolean).join("; ");
    this.byId("names-undo").disabled = !unsaved;
    this.byId("save").disabled = !this.page.map.can_save;
    this.byId("save").textContent = this.page.map.file ? `Save ${this.page.map.file}` : "Save";
    this.page.scene.draw();
  }
}
