// Start and goal by name: what they may mean while somebody types, and favourites.

import { element } from "./route.js";
import { settings, t } from "./texts.js";

const FARTHEST = 1e7; // cells, as far as the server takes points

export class Ends {
  #found = { start: [], goal: [] };
  #active = 0;
  #asked = 0;
  #favourites = new Set();

  constructor(page) {
    this.page = page;
    this.byId = (id) => document.getElementById(id);
  }

  connect(reported) {
    for (const which of ["start", "goal"]) {
      const field = this.byId(which);
      field.addEventListener("input", reported(() => this.#suggest(which), false));
      field.addEventListener("focus", reported(() => this.#suggest(which, ""), false));
      field.addEventListener("blur", () => this.#close(which));
      field.addEventListener("keydown", reported((event) => this.#pressed(which, event), false));
      this.byId(`${which}-star`).addEventListener("click", reported(() => this.#favour(which)));
      this.byId(`${which}-list`).addEventListener("pointerdown", (event) => event.preventDefault()); // the field keeps the focus
    }
  }

  // Learn the favourites, once the server has the rooms.
  async begin() {
    await this.#find("");
  }

  // Text of an end in a field, which the command line takes too: "2: kitchen".
  textOf(floor, name) {
    return this.page.floors.named(floor, (floorName) => `${floorName}: `) + name;
  }

  async #find(text) {
    const { found } = await this.page.link.post("find", { text: text.slice(0, 200) }, "");
    for (const each of found) this.#mark(each, each.favourite);
    return found;
  }

  async #suggest(which, text = this.byId(which).value) {
    if (!this.page.map.ready) return;
    this.#active = -1; // Enter takes nothing from a list that is about an older text
    const number = (this.#asked += 1);
    const found = /^[-\d.,;\s]+$/.test(text) && text.includes(",") ? [] : await this.#find(text);
    if (number !== this.#asked || document.activeElement !== this.byId(which)) return;
    this.#found[which] = found;
    this.#active = text ? 0 : -1;
    this.#list(which, text);
  }

  #list(which, text = this.byId(`${which}-list`).dataset.asked) {
    const { floors } = this.page;
    const items = this.#found[which].map((each, at) => {
      const where = floors.named(each.floor, (name) => t("on-floor", name));
      const item = element("li", { id: `${which}-${at}`, role: "option", ariaSelected: String(at === this.#active) },
        element("span", {}, each.favourite ? t("favourite", each.name) : each.name), element("small", {}, where));
      item.addEventListener("click", () => this.choose(which, each));
      return item;
    });
    this.byId(`${which}-list`).replaceChildren(...items);
    this.byId(`${which}-list`).dataset.asked = text;
    this.byId(`${which}-list`).hidden = !items.length;
    const field = this.byId(which);
    field.ariaExpanded = String(items.length > 0);
    const active = items[this.#active];
    if (active) field.setAttribute("aria-activedescendant", active.id);
    else field.removeAttribute("aria-activedescendant");
    active?.scrollIntoView({ block: "nearest" });
  }

  #close(which) {
    this.#asked += 1;
    this.#found[which] = [];
    this.#list(which);
  }

  #pressed(which, event) {
    const count = this.#found[which].length;
    if (event.key === "Escape") this.#close(which);
    if (event.key === "Enter" && count && this.#active >= 0) {
      event.preventDefault();
      return this.choose(which, this.#found[which][this.#active]);
    }
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (!step || !count) return null;
    event.preventDefault();
    this.#active = (Math.max(this.#active, step < 0 ? 0 : -1) + step + count) % count;
    return this.#list(which);
  }

  // Take a room that was chosen, go on to the other end, and show the way when both are there.
  async choose(which, named) {
    this.#close(which);
    const { page } = this;
    page.say("");
    try {
      await this.take(which, await this.endOf(named));
    } catch (problem) {
      page.say(problem.message, true);
    }
  }

  async take(which, end) {
    const { routes, showFloor } = this.page;
    routes.ends[which] = end;
    routes.showEnds();
    if (routes.hasEnds) {
      if (matchMedia("(pointer: coarse)").matches) this.byId(which).blur(); // the keys of a phone hide the way
      await routes.planAndFrame();
      return;
    }
    this.byId(which === "start" ? "goal" : "start").focus();
    await showFloor(end.floor);
    routes.show();
  }

  // The end in a room of a name, or in the room at a point: where one may stand there, and said if it lies elsewhere.
  async endOf({ floor, name, point }) {
    const found = await this.page.link.post("stand", name ? { name } : { point }, `floor/${floor}/`);
    if (found.name && found.away_m > this.page.map.resolution_m) this.page.say(t("beside", found.name, found.away_m));
    if (!found.name) return null;
    return { floor, point: found.point, name: found.name, text: this.textOf(floor, found.name) };
  }

  // The end that the text of a field means; null after saying why there is none.
  async meant(which) {
    const { page } = this;
    const text = this.byId(which).value.trim();
    if (page.routes.ends[which]?.text === text) return page.routes.ends[which];
    const refused = (key, ...values) => {
      page.say(t(key, ...values), true);
      this.byId(which).focus();
      return null;
    };
    if (!text) return refused("ends-first");
    const [floor, rest] = page.floors.split(text);
    const numbers = rest.split(/[,;\s]+/).filter(Boolean).map(Number);
    if (numbers.length === 2 && numbers.every(Number.isFinite)) {
      if (floor < 0) return refused("no-floor", text);
      const point = page.scene.fromMetres(numbers, await page.floors.map(floor));
      if (point.some((value) => Math.abs(value) > FARTHEST)) return refused("far", t(which));
      return { floor, point, text: this.textOf(floor, rest.trim()) };
    }
    const found = await this.#find(text);
    if (!found.length) return refused(settings.face === "robot" ? "not-found-robot" : "not-found", text);
    if (found.length > 1 && (!found[0].same || found[1].same)) {
      const problem = refused("which", text);
      await this.#suggest(which, text);
      return problem;
    }
    return this.endOf(found[0]);
  }

  async #favour(which) {
    const { routes, link } = this.page;
    const end = routes.ends[which];
    const kept = !this.#favourites.has(this.textOf(end.floor, end.name));
    this.#mark(end, kept);
    this.showStars();
    await link.post("favour", { floor: end.floor, name: end.name, kept }, "");
    this.page.say(t(kept ? "kept" : "not-kept", end.name));
  }

  #mark({ floor, name }, isFavourite) {
    this.#favourites[isFavourite ? "add" : "delete"](this.textOf(floor, name));
  }

  showStars() {
    for (const which of ["start", "goal"]) {
      const [star, end] = [this.byId(`${which}-star`), this.page.routes.ends[which]];
      star.disabled = !end?.name;
      star.ariaPressed = String(this.#favourites.has(end?.text));
    }
  }
}
