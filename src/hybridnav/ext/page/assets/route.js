// Routes: two ends, a plan with its certificate, and alternatives.

import { ROUTE_COLOURS } from "./draw.js";
import { profileName, written, said, settings, t } from "./texts.js";

const MOST_UNDER_WAY = 3; // requests at a time
const phone = matchMedia("(max-width: 760px)");

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

// What routes are compared by: their metres, with those that rides count.
const amountOf = (route) => route.length_m + (route.charge_m ?? 0);

function passagesOf(route) {
  if (!route.solved) return "";
  if (route.rides) return route.rides.length ? t("by", route.rides.map((ride) => ride.link).join(", ")) : t("on-one-floor");
  const doors = (route.legs ?? []).filter((leg) => leg.door).map((leg) => leg.door).join(", ");
  return doors ? t("doors", doors) : t("no-doors");
}

const timeOf = (seconds) => (seconds < 1 ? `${written(1000 * seconds, 1)} ms` : t("seconds", written(seconds, 1)));
const metres = (value) => (value === null ? t("none") : t("metres", written(value, 2)));
const someMetres = (value) => t(value < 100 ? "metres" : "some-m", written(value < 100 ? Math.ceil(value) : 10 * Math.round(value / 10)));

// How long a route is, for people: its length, and over floors its time.
function shortly(route) {
  const minutes = route.rides ? [t("minutes", Math.max(1, Math.round(route.travel_s / 60)))] : [];
  return [someMetres(route.length_m), ...minutes].join(" · ");
}

export class Routes {
  ends = { start: null, goal: null }; // each { floor, point }
  routes = []; // the plan, or the plan and its alternatives
  chosen = 0;
  open = null; // the plan without closures and profile, while there are some
  grid = null; // the optimum on the grid
  refusal = ""; // why there is no route
  lit = -1; // the line of the words that is lit, with its door
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

  // Who goes, null for anyone.
  get profile() {
    return this.page.profiles.find(({ name }) => name === settings.profile) ?? null;
  }

  query(more = {}) {
    const { closures } = this.page;
    const end = ({ floor, point, name = null }) => ({ floor, point, name });
    const [start, goal] = [this.ends.start, this.ends.goal].map(end);
    return { start, goal, preset: this.byId("preset").value, closed: closures.asked, profile: this.profile?.name ?? null, stairs: this.byId("stairs").checked, language: settings.language, ...more };
  }

  // Plans are about all floors: their names have nothing before them.
  #post(name, asked) {
    return this.page.link.post(name, asked, "");
  }

  // --- ends

  setEnd(which, point, isBrief = false) {
    const { scene, floors, fields } = this.page;
    this.ends[which] = { floor: floors.at, point: scene.rounded(point), text: fields.textOf(floors.at, scene.textOf(point)) };
    this.showEnds();
    scene.draw();
    return this.plan(isBrief);
  }

  // For people a click means the room, and a free place in it; a robot stands where it is put.
  async putEnd(which, point) {
    const { floors, fields } = this.page;
    const { isLive } = this.page.link;
    const end = (settings.face === "staff" || !isLive) && await fields.endOf({ floor: floors.at, point });
    if (!end && !isLive) return this.page.say(t("not-in-file"), true);
    if (!end) return this.setEnd(which, point);
    this.ends[which] = end;
    this.showEnds();
    this.page.scene.draw();
    return this.plan();
  }

  showProfiles() {
    const options = this.page.profiles.map(({ name }) => element("option", { value: name }, profileName(name)));
    this.byId("profile").replaceChildren(element("option", { value: "" }, t("profile-none")), ...options);
    this.byId("profile").value = this.profile?.name ?? "";
    const { through_private: isPrivate = true, elsewhere = 1, stairs = true, width_m: wide, turn_m: turn } = this.profile ?? {};
    const asks = [!isPrivate && t("asks-private"), elsewhere > 1 && t("asks-corridors"), !stairs && t("asks-stairs"),
      wide && t("asks-wide", written(wide, 2)), turn && t("asks-turn", written(turn, 2))];
    this.byId("asks").textContent = asks.filter(Boolean).join(", ");
    this.byId("stairs-row").hidden = !stairs;
  }

  showEnds() {
    for (const which of ["start", "goal"]) this.byId(which).value = this.ends[which]?.text ?? "";
    this.page.fields.showStars();
  }

  clicked(point) {
    if (this.hasEnds) this.clear();
    return this.putEnd(this.ends.start ? "goal" : "start", point);
  }

  async typed() {
    const { fields } = this.page;
    const start = await fields.meant("start");
    if (start && !this.byId("goal").value.trim()) {
      await fields.take("start", start);
      return;
    }
    const goal = start && await fields.meant("goal");
    if (!goal) return;
    this.ends = { start, goal };
    this.showEnds();
    await this.planAndFrame();
  }

  // Plan between ends that were typed; staff see the way from its start, which may lie elsewhere.
  async planAndFrame() {
    const { page } = this;
    await this.plan();
    if (settings.face === "robot") return;
    const part = this.routes[this.chosen]?.parts[0];
    await page.showFloor(part?.floor ?? this.ends.start.floor);
    if (part) page.scene.frame(part.line);
  }

  clear() {
    this.#asked += 1;
    this.#answered = this.#asked; // what is still under way is about other ends
    Object.assign(this, { ends: { start: null, goal: null }, routes: [], open: null, grid: null, chosen: 0, lit: -1 });
    this.showEnds();
    this.show();
  }

  // --- plans

  // A few requests at a time, so that none waits for the way of another; of those that come
  // meanwhile only the last is sent, and an answer older than the one shown is dropped.
  async plan(isBrief = false) {
    if (this.#isKept) this.take(this.page.link.routes);
    if (!this.hasEnds || this.#isKept) {
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
      if ((this.page.closures.all.length || asked.profile) && !asked.brief) open = await this.#planOpen(asked);
    } catch (error) {
      problem = error;
    }
    if (number < this.#answered) return;
    this.#answered = number;
    this.#plans += 1;
    Object.assign(this, { routes: found, open, grid: null, chosen: 0, lit: -1 });
    this.show(asked.brief);
    if (problem) this.page.say(problem.message, true);
  }

  #planOpen(asked) {
    return this.#post("plan", { ...asked, closed: {}, profile: null, all_open: true, brief: true });
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
      this.page.say(t("ends-first"), true);
      return;
    }
    this.page.say(t("searching"));
    const found = await this.#timely("alternatives", this.query({ count: Number(this.byId("count").value) }));
    if (!found) return;
    this.page.say("");
    if (found.routes.length) Object.assign(this, { routes: found.routes, chosen: 0, grid: null, open: null, lit: -1 });
    this.show();
    const note = said(found.note);
    if (found.routes.length) this.byId("others-note").textContent = note.charAt(0).toUpperCase() + note.slice(1);
    else this.page.say(t("no-others", note), true);
  }

  choose(at) {
    Object.assign(this, { chosen: at, lit: -1 });
    this.#takeEnds();
    this.show();
    this.byId("others").children[at]?.focus();
  }

  // Routes of a saved page have ends of their own.
  #takeEnds() {
    const { start, goal } = this.routes[this.chosen] ?? {};
    if (!start) return;
    for (const end of [start, goal]) end.text = end.name ? this.page.fields.textOf(end.floor, end.name) : "";
    this.ends = { start, goal };
    this.showEnds();
  }

  take(routes) {
    this.routes = routes;
    this.#takeEnds();
  }

  // Whether a route of a saved page is shown, which needs no plan.
  get #isKept() {
    const { start, goal } = this.routes[this.chosen] ?? {};
    return Boolean(start) && this.ends.start === start && this.ends.goal === goal;
  }

  // --- the panel

  show(isBrief = false) {
    const route = this.routes[this.chosen];
    const { canvas, scene } = this.page;
    canvas.dataset.plans = this.#plans;
    canvas.dataset.length = route?.length_m ?? "";
    this.page.pictures.showHeights();
    scene.draw();
    this.#showFigures(route);
    this.byId("optimum").disabled = !this.hasEnds;
    if (isBrief) return; // words and lists follow when the end is dropped
    this.#showWay(route);
    this.#showCards();
    this.byId("others-note").textContent = "";
    this.page.floors.note();
    this.#place(Boolean(route?.solved));
    const before = this.refusal;
    this.refusal = this.#refusalOf(route);
    if (this.refusal !== before) this.page.say("");
  }

  #refusalOf(route) {
    if (!route || route.solved) return "";
    if (route.why && this.profile) return t("no-route", said(route.why));
    if (!route.why && this.open?.solved) return t("no-route", t("all-closed"));
    return [t("no-route", said(route.status)), route.why].filter(Boolean).join(". ");
  }

  // On a phone the way stands above the controls: it is what somebody reads while walking.
  #place(isRouted) {
    document.documentElement.classList.toggle("routed", isRouted);
    const [result, modes, home] = ["result", "modes", "route"].map(this.byId);
    const isFirst = isRouted && phone.matches;
    const [place, side] = !isFirst ? [home, "after"] : [modes, settings.face === "staff" ? "after" : "before"];
    const beside = side === "after" ? result.previousElementSibling : result.nextElementSibling;
    if (beside !== place) place[side](result); // a move takes the focus away
    if (isFirst) this.byId("panel").scrollTop = 0;
  }

  #showFigures(route) {
    const rows = !route?.solved ? [] : settings.face === "staff" ? this.#rowsForStaff(route) : this.#rowsForRobot(route);
    const text = JSON.stringify(rows);
    if (text === this.#last) return;
    this.#last = text;
    this.byId("figures").replaceChildren(
      ...rows.flatMap(([name, value]) => [element("dt", {}, t(name)), element("dd", {}, value)]));
  }

  #rowsForStaff(route) {
    const rows = [["length", shortly(route)]];
    if (!this.open?.solved) return rows;
    const metresMore = route.length_m - this.open.length_m;
    const minutesMore = Math.round(((route.travel_s ?? 0) - (this.open.travel_s ?? 0)) / 60);
    const more = [metresMore > 0.5 && someMetres(metresMore), minutesMore > 0 && t("min", minutesMore)].filter(Boolean).join(", ");
    if (more) rows.push(["detour", t(this.profile ? "detour-profile" : "detour-staff", more)]);
    else if (this.profile) rows.push(["detour", t("no-detour")]);
    return rows;
  }

  #rowsForRobot(route) {
    const isDearer = route.metric === "weighted" || route.rides?.length > 0; // a cost, not a length
    const isOptimal = route.gap !== null && route.gap < 1e-9;
    const rows = [["length", `${metres(route.length_m)} ${route.metric === "weighted" ? "" : t(route.metric)}`], ...this.#ridesOf(route)];
    if (isDearer) rows.push(["cost", metres(route.cost)]);
    const isKept = isOptimal || route.lower_bound === null; // an optimal bound is the length
    const bound = isKept ? route.lower_bound : Math.floor(100 * route.lower_bound) / 100;
    rows.push(["bound", t("bound-is", metres(bound), t(isDearer ? "cheaper" : "shorter"))]);
    rows.push(["gap", isOptimal ? t("optimal") : `${written(Math.ceil(1e4 * route.gap) / 100, 2)} %`]);
    if (this.open?.solved) rows.push(["detour", t("detour-is", metres(amountOf(route) - amountOf(this.open)), metres(amountOf(this.open)))]);
    if (this.grid?.solved) rows.push(["grid", t("grid-is", metres(amountOf(this.grid)))]);
    return [...rows, ["time", t("time-is", timeOf(route.seconds))]];
  }

  #ridesOf(route) {
    const { floors } = this.page;
    const rides = (route.rides ?? []).map((ride) => ["ride", t("ride-is", ride.link, floors.nameOf(ride.from), floors.nameOf(ride.to), Math.round(ride.seconds), metres(ride.charge_m))]);
    return route.travel_s === undefined ? rides : [...rides, ["travel", t("seconds", Math.round(route.travel_s))]];
  }

  #showWay(route) {
    const steps = route?.rides
      ? route.parts.flatMap((part, at) => [t("on-floor", this.page.floors.nameOf(part.floor)), route.rides[at]?.link])
      : (route?.legs ?? []).flatMap((leg) => [leg.room ?? t(`shape-${leg.shape}`), leg.door && t("door-n", leg.door)]);
    this.byId("way").textContent = steps.filter(Boolean).join(" → ");
    const names = [this.ends.start, this.ends.goal].map((end) => end?.name ?? end?.text ?? "");
    this.byId("trip").textContent = route?.solved && names[0] ? t("trip", ...names) : "";
    this.byId("words").replaceChildren(...(route?.words ?? []).map((line, at) => {
      const button = element("button", { type: "button", onclick: () => this.goTo(at) }, line.text);
      for (const [kind, lit] of [["mouseenter", at], ["focus", at], ["mouseleave", -1], ["blur", -1]]) button.addEventListener(kind, () => this.light(lit));
      return element("li", {}, button);
    }));
  }

  // --- a line of the words, and what it is about

  get lines() {
    return this.routes[this.chosen]?.words ?? [];
  }

  // What a line is about on the floor that is shown: its door, or the place where one follows it.
  spotOf(line) {
    if (line?.floor !== this.page.floors.at) return null;
    const door = this.page.map.rooms.doors.find((each) => each.number === line.door);
    return { at: door?.at ?? line.at, door: line.door };
  }

  // Light a line and its door on the map; -1 for none.
  light(at) {
    if (at === this.lit) return;
    this.lit = at;
    const items = this.byId("words").children;
    for (const [number, item] of [...items].entries()) item.classList.toggle("lit", number === at);
    this.page.canvas.dataset.lit = at < 0 ? "" : `${at} ${this.lines[at].door ?? ""}`;
    this.page.scene.draw();
  }

  // Light the line that is about a point of the screen; return whether there is one.
  lightAt(at) {
    const { scene } = this.page;
    const away = (line) => {
      const spot = this.spotOf(line);
      return spot ? Math.hypot(...scene.toScreen(spot.at).map((value, axis) => value - at[axis])) : Infinity;
    };
    const least = Math.min(...this.lines.map(away));
    const found = least < 14 ? this.lines.findLastIndex((line) => away(line) === least) : -1;
    this.light(found);
    return found >= 0;
  }

  async goTo(at) {
    await this.page.showFloor(this.lines[at].floor);
    this.page.scene.reveal(this.spotOf(this.lines[at]).at);
    this.light(at);
  }

  #showCards() {
    const shortest = this.routes[0];
    const cards = this.routes.length < 2 ? [] : this.routes.map((route, at) => {
      const colour = ROUTE_COLOURS[this.page.scene.theme][at % 5];
      const isOther = at && !route.start && route.solved && shortest.solved; // between the same ends
      const more = isOther ? metres(amountOf(route) - amountOf(shortest)) : "";
      const long = !route.solved ? "" : settings.face === "staff" ? shortly(route) : metres(amountOf(route));
      const text = !route.solved ? t("no-route", said(route.status)) : more && settings.face === "robot" ? t("more", long, more) : long;
      const line = picture(`<path d="M2 4h22" stroke="${colour}" stroke-width="4" stroke-linecap="round"/>`);
      return element("button", { className: "route-card", ariaPressed: String(at === this.chosen), onclick: () => this.choose(at) },
        line, element("span", {}, text), element("small", {}, passagesOf(route)));
    });
    this.byId("others").replaceChildren(...cards);
  }
}
