// The floors of a building: which one is shown, the links between them, and what has ends on them.

import { element } from "./route.js";

export class Floors {
  names = [""]; // from the lowest to the highest; a map is one floor without a name
  links = [];
  at = 0; // the number of the one that is shown
  #wanted = 0;
  #maps = [];
  #views = [];

  constructor(page) {
    this.page = page;
    this.byId = (id) => document.getElementById(id);
  }

  nameOf(number) {
    return this.names[number];
  }

  // A text with the name of a floor in it, empty for a floor without one: nothing names a map's.
  named(number, text) {
    return this.names[number] && text(this.names[number]);
  }

  // Take over what the first answer says, and return the map to begin with.
  async begin(whole) {
    Object.assign(this, { names: whole.floors, links: whole.links, title: whole.name, presets: whole.presets });
    this.#maps = [];
    const numbers = this.names.map((_, number) => number).reverse(); // as in a house, the highest on top
    this.byId("floor").replaceChildren(...numbers.map((number) => element("option", { value: number }, this.names[number])));
    this.byId("floors").hidden = !this.names[0];
    document.documentElement.classList.toggle("building", Boolean(this.names[0]));
    return this.map(0);
  }

  async map(number) {
    this.#maps[number] ??= await this.page.link.get("map", `floor/${number}/`);
    return this.#maps[number];
  }

  // Show another floor; return whether it has changed.
  async show(number) {
    if ((number === this.at && number === this.#wanted) || !(number in this.names)) return false;
    const { scene } = this.page;
    this.#wanted = number;
    const map = await this.map(number);
    if (this.#wanted !== number) return false; // another one has been chosen meanwhile
    this.#views[this.at] = scene.place;
    this.at = number;
    this.page.map = map;
    this.page.link.base = `floor/${number}/`;
    scene.show(this.page.map, this.#views[number]);
    this.note();
    return true;
  }

  // Ends of links on the floor that is shown: { link, at, others }.
  get ends() {
    return this.links.flatMap((link) => link.ends
      .filter((end) => end.floor === this.at)
      .map((end) => ({ link, at: end.at })));
  }

  // Say in the list of floors which ones a route visits, and where it starts and ends.
  note() {
    const { routes } = this.page;
    const visited = new Set((routes?.routes[routes.chosen]?.parts ?? []).map((part) => part.floor));
    for (const option of this.byId("floor").options) {
      const number = Number(option.value);
      const marks = [["A", routes?.ends.start], ["B", routes?.ends.goal]].filter(([, end]) => end?.floor === number).map(([letter]) => letter);
      if (!marks.length && visited.has(number)) marks.push("route");
      option.textContent = this.names[number] + (marks.length ? ` (${marks.join(", ")})` : "");
    }
    this.byId("floor").value = this.at;
    this.byId("floor-up").disabled = this.at + 1 >= this.names.length;
    this.byId("floor-down").disabled = this.at === 0;
  }

  // "2: 1.5, 3" as [2, "1.5, 3"]; a text without a floor is about the one that is shown.
  split(text) {
    const colon = this.names[0] ? text.lastIndexOf(":") : -1;
    if (colon < 0) return [this.at, text];
    return [this.names.indexOf(text.slice(0, colon).trim()), text.slice(colon + 1)];
  }
}
