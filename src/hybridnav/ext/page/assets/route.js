// Routes: two ends, a plan with its certificate, and alternatives.

import { ROUTE_COLOURS } from "./draw.js";

const MOST_UNDER_WAY = 3; // requests at a time
const FARTHEST = 1e7; // cells, as far as the server takes points
const METRICS = { "any-angle": "at any angle", octile: "from cell to cell", weighted: "by costs" };

export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key in made && key !== "style") made[key] = value;
    else made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

export function picture(content) {
  const holder = element("span");
  holder.innerHTML = `<svg width="26" height="14" aria-hidden="true">${content}</svg>`;
  return holder.firstChild;
}

// What routes are compared by: with rides, which have no length, the cost.
const amountOf = (route) => (route.rides?.length ? route.cost : route.length_m);

function passagesOf(route) {
  if (!route.solved) return "";
  if (route.rides) return route.rides.length ? `by ${route.rides.map((ride) => ride.link).join(", ")}` : "on one floor";
  const doors = (route.legs ?? []).filter((leg) => leg.door).map((leg) => leg.door).join(", ");
  return doors ? `doors ${doors}` : "no doors";
}

const timeOf = (seconds) => (seconds < 1 ? `${(1000 * seconds).toFixed(1)} ms` : `${seconds.toFixed(1)} s`);
const metres = (value) => (value === null ? "none" : `${value.toFixed(2)} m`);

export class Routes {
  ends = { start: null, goal: null }; // each { floor, point }
  routes = []; // the plan, or the plan and its alternatives
  chosen = 0;
  open = null; // the plan without closures, while something is closed
  grid = null; // the optimum on the grid
  #wanted = null;
  #underWay = 0;
  #asked = 0;
  #answered = 0;
  #plans = 0;
  #last = "";

  constructor(page) {
    this.page = page;
    this.byId = (id) => document.getElementById(id);
  }

  get hasEnds() {
    return Boolean(this.ends.start && this.ends.goal);
  }

  // The point of an end if it lies on the floor that is shown.
  here(which) {
    const end = this.ends[which];
    return end?.floor === this.page.floors.at ? end.point : null;
  }

  query(more = {}) {
    const { closures } = this.page;
    const preset = this.byId("preset").value;
    return { ...this.ends, preset, closed: closures.asked, stairs: this.byId("stairs").checked, ...more };
  }

  // Plans are about all floors: their names have nothing before them.
  #post(name, asked) {
    return this.page.link.post(name, asked, "");
  }

  // --- ends

  setEnd(which, point, isBrief = false) {
    const { scene, floors } = this.page;
    this.ends[which] = { floor: floors.at, point: scene.rounded(point) };
    this.byId(which).value = this.#textOf(floors.at, scene.textOf(point));
    scene.draw();
    return this.plan(isBrief);
  }

  #textOf(floor, text) {
    return this.page.floors.named(floor, (name) => `${name}: `) + text;
  }

  clicked(point) {
    if (this.hasEnds) this.clear();
    return this.setEnd(this.ends.start ? "goal" : "start", point);
  }

  async typed() {
    const ends = {};
    for (const which of ["start", "goal"]) {
      const [floor, text] = this.page.floors.split(this.byId(which).value);
      const numbers = text.split(/[,;\s]+/).filter(Boolean).map(Number);
      if (floor < 0 || numbers.length !== 2 || !numbers.every(Number.isFinite)) {
        const before = floor < 0 ? "the name of a floor, a colon, and " : "";
        this.page.say(`Expected ${before}two numbers of metres for the ${which}, such as 1.5, 2`, true);
        this.byId(which).focus();
        return null;
      }
      const point = this.page.scene.fromMetres(numbers, await this.page.floors.map(floor));
      if (point.some((value) => Math.abs(value) > FARTHEST)) {
        this.page.say(`The ${which} lies far outside of the map`, true);
        this.byId(which).focus();
        return null;
      }
      ends[which] = { floor, point };
      this.byId(which).value = this.#textOf(floor, text.trim());
    }
    this.ends = ends;
    return this.plan();
  }

  clear() {
    this.#asked += 1;
    this.#answered = this.#asked; // what is still under way is about other ends
    Object.assign(this, { ends: { start: null, goal: null }, routes: [], open: null, grid: null, chosen: 0 });
    for (const id of ["start", "goal"]) this.byId(id).value = "";
    this.show();
  }

  // --- plans

  // A few requests at a time, so that none waits for the way of another; of those that come
  // meanwhile only the last is sent, and an answer older than the one shown is dropped.
  async plan(isBrief = false) {
    if (!this.hasEnds) {
      this.show();
      return;
    }
    this.#wanted = this.query({ brief: isBrief });
    if (this.#underWay >= MOST_UNDER_WAY) return;
    this.#underWay += 1;
    this.page.canvas.dataset.busy = "true";
    while (this.#wanted) {
      const asked = this.#wanted;
      this.#wanted = null;
      await this.#planned(asked, (this.#asked += 1));
    }
    this.#underWay -= 1;
    this.page.canvas.dataset.busy = String(this.#underWay > 0);
  }

  async #planned(asked, number) {
    let [found, open, problem] = [[], null, null];
    try {
      found = [await this.#post("plan", asked)];
      if (this.page.closures.list.length && !asked.brief) open = await this.#planOpen(asked);
    } catch (error) {
      problem = error;
    }
    if (number < this.#answered) return;
    this.#answered = number;
    this.#plans += 1;
    Object.assign(this, { routes: found, open, grid: null, chosen: 0 });
    this.show(asked.brief);
    if (problem) this.page.say(problem.message, true);
  }

  #planOpen(asked) {
    return this.#post("plan", { ...asked, closed: {}, brief: true });
  }

  // An answer about the ends of now, null for one that came after they were moved.
  async #timely(name, asked) {
    const number = this.#asked;
    const found = await this.#post(name, asked);
    return number === this.#asked && !this.#wanted ? found : null;
  }

  async optimum() {
    if (!this.hasEnds) return;
    const found = await this.#timely("optimum", this.query());
    if (!found) return;
    this.grid = found;
    this.show();
  }

  async alternatives() {
    if (!this.hasEnds) {
      this.page.say("Set a start and a goal first", true);
      return;
    }
    this.page.say("Looking for routes…");
    const found = await this.#timely("alternatives", this.query({ count: Number(this.byId("count").value) }));
    if (!found) return;
    if (found.routes.length) Object.assign(this, { routes: found.routes, chosen: 0, grid: null, open: null });
    this.show();
    const note = found.note.charAt(0).toUpperCase() + found.note.slice(1);
    if (found.routes.length) this.byId("others-note").textContent = note;
    else this.page.say(`No routes: ${found.note}`, true);
  }

  choose(at) {
    this.chosen = at;
    this.#takeEnds();
    this.show();
    this.byId("others").children[at]?.focus();
  }

  // Routes of a saved page have ends of their own.
  #takeEnds() {
    const { start, goal } = this.routes[this.chosen] ?? {};
    if (start) this.ends = { start, goal };
  }

  take(routes) {
    this.routes = routes;
    this.#takeEnds();
  }

  // --- the panel

  show(isBrief = false) {
    const route = this.routes[this.chosen];
    const { canvas, scene } = this.page;
    canvas.dataset.plans = this.#plans;
    canvas.dataset.length = route?.length_m ?? "";
    scene.draw();
    this.#showFigures(route);
    this.byId("optimum").disabled = !this.hasEnds;
    if (isBrief) return; // words and lists follow when the end is dropped
    this.#showWay(route);
    this.#showCards();
    this.byId("others-note").textContent = "";
    this.page.floors.note();
    if (route) this.page.say(route.solved ? "" : `No route: ${route.status}`, !route.solved);
  }

  #showFigures(route) {
    const rows = [];
    if (route?.solved) {
      const isDearer = route.metric === "weighted" || route.rides?.length > 0; // a cost, not a length
      rows.push(["length", `${metres(route.length_m)} ${route.metric === "weighted" ? "" : METRICS[route.metric] ?? ""}`]);
      rows.push(...this.#ridesOf(route));
      if (isDearer) rows.push(["cost", metres(route.cost)]);
      const isOptimal = route.gap !== null && route.gap < 1e-9;
      rows.push(["bound", `${metres(route.lower_bound)}: nothing is ${isDearer ? "cheaper" : "shorter"}`]);
      rows.push(["gap", isOptimal ? "0 %, proved optimal" : `${(100 * route.gap).toFixed(2)} %`]);
      if (this.open?.solved) rows.push(["detour", `${metres(amountOf(route) - amountOf(this.open))} more than ${metres(amountOf(this.open))}`]);
      if (this.grid?.solved) rows.push(["grid", `${metres(amountOf(this.grid))} on the cells of the whole grid`]);
      rows.push(["time", `${timeOf(route.seconds)} to plan`]);
    }
    const text = JSON.stringify(rows);
    if (text === this.#last) return;
    this.#last = text;
    this.byId("figures").replaceChildren(
      ...rows.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)]));
  }

  #ridesOf(route) {
    const { floors } = this.page;
    const rides = (route.rides ?? []).map((ride) => ["ride", `${ride.link}, floor ${floors.nameOf(ride.from)} to ${floors.nameOf(ride.to)}: ${Math.round(ride.seconds)} s, charged ${metres(ride.charge_m)}`]);
    return route.travel_s === undefined ? rides : [...rides, ["travel", `${Math.round(route.travel_s)} s`]];
  }

  #showWay(route) {
    const steps = route?.rides
      ? route.parts.flatMap((part, at) => [`floor ${this.page.floors.nameOf(part.floor)}`, route.rides[at]?.link])
      : (route?.legs ?? []).flatMap((leg) => [leg.room, leg.door && `door ${leg.door}`]);
    this.byId("way").textContent = steps.filter(Boolean).join(" → ");
    this.byId("words").replaceChildren(...(route?.words ?? []).map((line) => element("li", {}, line)));
  }

  #showCards() {
    const shortest = this.routes[0];
    const cards = this.routes.length < 2 ? [] : this.routes.map((route, at) => {
      const colour = ROUTE_COLOURS[this.page.scene.theme][at % 5];
      const isOther = at && !route.start && route.solved && shortest.solved; // between the same ends
      const more = isOther ? `, ${metres(amountOf(route) - amountOf(shortest))} more` : "";
      const text = route.solved ? metres(amountOf(route)) + more : `no route: ${route.status}`;
      const line = picture(`<path d="M2 4h22" stroke="${colour}" stroke-width="4" stroke-linecap="round"/>`);
      return element("button", { className: "route-card", ariaPressed: String(at === this.chosen), onclick: () => this.choose(at) },
        line, element("span", {}, text), element("small", {}, passagesOf(route)));
    });
    this.byId("others").replaceChildren(...cards);
  }
}
