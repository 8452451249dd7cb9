// Routes: two ends, a plan with its certificate, alternatives, and what is closed.

import { ROUTE_COLOURS } from "./draw.js";

const MOST_UNDER_WAY = 3; // requests at a time
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

const metres = (value) => (value === null ? "none" : `${value.toFixed(2)} m`);

export class Routes {
  start = null;
  goal = null;
  routes = []; // the plan, or the plan and its alternatives
  chosen = 0;
  open = null; // the plan without closures, while something is closed
  grid = null; // the optimum on the grid
  closed = { doors: [], rooms: [], polygons: [] };
  draft = []; // corners of an area that is being drawn
  #before = []; // closures to go back to
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

  get isClosed() {
    return Object.values(this.closed).some((list) => list.length);
  }

  query(more = {}) {
    const { start, goal, closed } = this;
    return { start, goal, preset: this.byId("preset").value, closed, ...more };
  }

  // --- ends

  setEnd(which, point, isBrief = false) {
    this[which] = this.page.scene.rounded(point);
    this.byId(which).value = this.page.scene.textOf(point);
    this.page.scene.draw();
    return this.plan(isBrief);
  }

  clicked(point) {
    if (this.start && this.goal) {
      this.clear();
    }
    return this.setEnd(this.start ? "goal" : "start", point);
  }

  typed() {
    for (const which of ["start", "goal"]) {
      const numbers = this.byId(which).value.split(/[,;\s]+/).filter(Boolean).map(Number);
      if (numbers.length !== 2 || !numbers.every(Number.isFinite)) {
        this.page.say(`Expected two numbers of metres for the ${which}, such as 1.5, 2`, true);
        this.byId(which).focus();
        return null;
      }
      this[which] = this.page.scene.fromMetres(numbers);
    }
    return this.plan();
  }

  clear() {
    this.#asked += 1;
    this.#answered = this.#asked; // what is still under way is about other ends
    Object.assign(this, { start: null, goal: null, routes: [], open: null, grid: null, chosen: 0 });
    for (const id of ["start", "goal"]) this.byId(id).value = "";
    this.show();
  }

  // --- plans

  // A few requests at a time, so that none waits for the way of another; of those that come
  // meanwhile only the last is sent, and an answer older than the one shown is dropped.
  async plan(isBrief = false) {
    if (!this.start || !this.goal) {
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
      found = [await this.page.link.post("plan", asked)];
      if (this.isClosed && !asked.brief) open = await this.#planOpen(asked);
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
    const closed = { doors: [], rooms: [], polygons: [] };
    return this.page.link.post("plan", { ...asked, closed, brief: true });
  }

  async optimum() {
    if (!this.start || !this.goal) return;
    this.grid = await this.page.link.post("optimum", this.query());
    this.show();
  }

  async alternatives() {
    if (!this.start || !this.goal) {
      this.page.say("Set a start and a goal first", true);
      return;
    }
    this.page.say("Looking for routes…");
    const more = { count: Number(this.byId("count").value), by: this.byId("by").value };
    const found = await this.page.link.post("alternatives", this.query(more));
    Object.assign(this, { routes: found.routes, chosen: 0, grid: null, open: null });
    this.show();
    this.byId("others-note").textContent = found.note;
  }

  choose(at) {
    this.chosen = at;
    const { start, goal } = this.routes[at]; // routes of a saved page have ends of their own
    if (start) Object.assign(this, { start, goal });
    this.show();
    this.byId("others").children[at]?.focus();
  }

  // --- closures

  close(kind, what) {
    this.#before.push(structuredClone(this.closed));
    const list = this.closed[kind];
    const at = kind === "polygons" ? -1 : list.indexOf(what);
    if (at < 0) list.push(what);
    else list.splice(at, 1);
    return this.#closedChanged();
  }

  undoClosed() {
    if (this.#before.length) this.closed = this.#before.pop();
    return this.#closedChanged();
  }

  openAll() {
    if (this.isClosed) this.#before.push(structuredClone(this.closed));
    this.closed = { doors: [], rooms: [], polygons: [] };
    return this.#closedChanged();
  }

  #open(kind, at) {
    this.#before.push(structuredClone(this.closed));
    this.closed[kind].splice(at, 1);
    return this.#closedChanged();
  }

  #closedChanged() {
    this.showClosed();
    this.page.scene.draw();
    return this.plan();
  }

  // Drop what no room or door stands behind any more.
  forget(rooms) {
    const doors = rooms.doors.map((door) => door.number);
    const names = rooms.rooms.map((room) => room.name);
    this.closed.doors = this.closed.doors.filter((number) => doors.includes(number));
    this.closed.rooms = this.closed.rooms.filter((name) => names.includes(name));
    this.#before = [];
    this.showClosed();
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
    if (isKept && corners.length >= 3) this.close("polygons", corners);
  }

  showClosed() {
    const names = { doors: (n) => `door ${n}`, rooms: (n) => n, polygons: (_, at) => `area ${at + 1}` };
    const items = Object.entries(names).flatMap(([kind, name]) =>
      this.closed[kind].map((what, at) => {
        const text = name(what, at);
        const button = element("button", { onclick: () => this.#open(kind, at), ariaLabel: `Open ${text}` }, "Open");
        return element("li", {}, text, button);
      }));
    this.byId("closed").replaceChildren(...items);
    this.byId("close-undo").disabled = !this.#before.length;
    this.byId("close-clear").disabled = !this.isClosed;
  }

  // --- the panel

  show(isBrief = false) {
    const route = this.routes[this.chosen];
    const { canvas, scene } = this.page;
    canvas.dataset.plans = this.#plans;
    canvas.dataset.length = route?.length_m ?? "";
    scene.draw();
    this.#showFigures(route);
    for (const id of ["optimum", "clear"]) this.byId(id).disabled = !(this.start && this.goal);
    if (isBrief) return; // words and lists follow when the end is dropped
    this.#showWay(route);
    this.#showCards();
    this.byId("others-note").textContent = "";
    if (route) this.page.say(route.solved ? "" : `No route: ${route.status}`, !route.solved);
  }

  #showFigures(route) {
    const rows = [];
    if (route?.solved) {
      rows.push(["length", `${metres(route.length_m)} ${route.metric === "weighted" ? "" : METRICS[route.metric] ?? ""}`]);
      if (route.metric === "weighted") rows.push(["cost", metres(route.cost)]);
      const isOptimal = route.gap !== null && route.gap < 1e-9;
      rows.push(["bound", `${metres(route.lower_bound)}: nothing is ${route.metric === "weighted" ? "cheaper" : "shorter"}`]);
      rows.push(["gap", isOptimal ? "0 %, proved optimal" : `${(100 * route.gap).toFixed(2)} %`]);
      if (this.open?.solved) rows.push(["detour", `${metres(route.length_m - this.open.length_m)} more than ${metres(this.open.length_m)}`]);
      if (this.grid?.solved) rows.push(["grid", `${metres(this.grid.length_m)} on the cells of the whole grid`]);
      rows.push(["time", `${(1000 * route.seconds).toFixed(1)} ms`]);
    }
    const text = JSON.stringify(rows);
    if (text === this.#last) return;
    this.#last = text;
    this.byId("figures").replaceChildren(
      ...rows.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)]));
  }

  #showWay(route) {
    const legs = route?.legs ?? [];
    const parts = legs.map((leg) => leg.room + (leg.door ? ` → door ${leg.door}` : ""));
    this.byId("way").textContent = parts.join(" → ");
    this.byId("words").replaceChildren(...(route?.words ?? []).map((line) => element("li", {}, line)));
  }

  #showCards() {
    const shortest = this.routes[0];
    const cards = this.routes.length < 2 ? [] : this.routes.map((route, at) => {
      const colour = ROUTE_COLOURS[this.page.scene.theme][at % 5];
      const isOther = at && !route.start && route.solved && shortest.solved; // between the same ends
      const more = isOther ? `, ${metres(route.length_m - shortest.length_m)} more` : "";
      const text = route.solved ? metres(route.length_m) + more : `no route: ${route.status}`;
      const doors = (route.legs ?? []).filter((leg) => leg.door).map((leg) => leg.door).join(", ");
      const line = picture(`<path d="M2 4h22" stroke="${colour}" stroke-width="4" stroke-linecap="round"/>`);
      return element("button", { className: "route-card", ariaPressed: String(at === this.chosen), onclick: () => this.choose(at) },
        line, element("span", {}, text), element("small", {}, doors ? `doors ${doors}` : "no doors"));
    });
    this.byId("others").replaceChildren(...cards);
  }
}
