// The page: connects its controls with the map, the routes and the rooms.

import { Closures } from "./closures.js";
import { inksOf, linkBox, linkOutline, paintClosed, paintDashed, paintDoors, paintEnd, paintGraph, paintLinks, paintNames, paintOutline, paintRoutes, paintScaleBar } from "./draw.js";
import { Floors } from "./floors.js";
import { download, openLink } from "./link.js";
import { Names } from "./names.js";
import { Routes, element, picture } from "./route.js";
import { Scene, steer } from "./scene.js";

const byId = (id) => document.getElementById(id);
const FILES = { nav2: "route-graph.geojson", model: "model.hnm", rooms: "rooms.geojson", "path-geojson": "path.geojson", "path-csv": "path.csv" };
const END_REACH = 14; // pixels
const systemTheme = matchMedia("(prefers-color-scheme: dark)");

const page = {
  canvas: byId("map"),
  link: openLink(),
  graph: null,
  costs: null,

  say(text, isProblem = false) {
    byId("status").textContent = text;
    byId("status").classList.toggle("problem", isProblem);
  },

  // Draw anew what depends on the rooms.
  async changed() {
    page.graph = null;
    await showLayer();
    page.legend();
    await page.routes.plan();
  },

  legend: () => showLegend(),
};
page.floors = new Floors(page);
page.closures = new Closures(page);

const mode = () => document.querySelector("input[name=mode]:checked").value;
const near = (one, other, reach) => Math.hypot(one[0] - other[0], one[1] - other[1]) < reach;

function reported(work, isOwn = true) {
  return async (event) => {
    if (isOwn) event?.preventDefault?.();
    try {
      await work(event);
    } catch (problem) {
      page.say(problem.message, true);
    }
  };
}

// --- pictures

function usedTheme() {
  const chosen = byId("theme").value;
  return chosen === "auto" ? (systemTheme.matches ? "dark" : "light") : chosen;
}

function useTheme() {
  page.scene.theme = usedTheme();
  document.documentElement.dataset.theme = page.scene.theme;
  document.documentElement.style.colorScheme = page.scene.theme;
  page.routes.show();
  showLegend();
}

async function showLayer() {
  const colours = byId("colours").value;
  const level = byId("level").value;
  byId("level-row").hidden = colours !== "level" || !page.link.isLive;
  page.scene.layer = colours === "level" ? `level-${level}` : colours;
  const facts = page.map.levels[level];
  byId("level-text").textContent = `${level}${facts.name ? ` (${facts.name})` : ""}`;
  byId("level").setAttribute("aria-valuetext", `level ${level}, ${facts.vertices} vertices, ${facts.arcs} arcs`);
  const wanted = colours === "level" ? level : String(page.map.place_level);
  if (byId("show-graph").checked && page.graph?.level !== Number(wanted)) {
    page.graph = await page.link.get(`graph/${wanted}`);
    if (!page.graph.drawn) page.say(`Level ${wanted} has ${page.graph.vertices.toLocaleString("en")} vertices: too many to draw its arcs`);
  }
  page.scene.draw();
}

async function showCosts() {
  page.scene.overlay = null;
  page.costs = null;
  if (byId("show-costs").checked) {
    const preset = byId("preset").value;
    page.costs = await page.link.get(`costs/${preset}`);
    if (page.costs.most === null) page.say(`Preset ${preset} plans by lengths, without costs: choose robot, or start with --costs`, true);
    else page.scene.overlay = `costs-${preset}`;
  }
  showLegend();
  page.scene.draw();
}

function showLegend() {
  const colours = page.map.colours[page.scene.theme];
  const inks = inksOf(page.scene);
  const box = (colour) => `<rect x="1" y="1" width="24" height="12" fill="${colour}" stroke="${inks.rim}"/>`;
  const three = (first) => [0, 1, 2].map((n) => `<rect x="${1 + 8 * n}" y="1" width="8" height="12" fill="${colours[first + n]}"/>`).join("");
  const line = (colour, dash = "") => `<path d="M1 7h24" stroke="${colour}" stroke-width="2" stroke-dasharray="${dash}"/>`;
  const shown = byId("colours").value;
  const entries = [[box(colours[0]), "free"], [box(colours[1]), "unexplored"], [box(colours[2]), `within ${page.map.robot_radius_m} m`], [box(colours[3]), "occupied"]];
  if (shown !== "map") entries.push([three(4), shown === "rooms" ? "rooms" : "free places"]);
  if (shown === "level") entries.push([three(10), "unexplored places"]);
  if (byId("show-graph").checked) {
    entries.push([`${line(inks.free)}<circle cx="5" cy="7" r="3.5" fill="${inks.ink}"/>`, "place, arc"], [line(inks.loop, "4 2"), "self-loop"]);
  }
  if (byId("show-doors").checked) {
    entries.push([`<circle cx="13" cy="7" r="5" fill="${inks.door}"/>`, "door"], [`<rect x="8" y="2" width="10" height="10" fill="${inks.door}"/>`, "opening"],
      [`<circle cx="13" cy="7" r="4.5" fill="${inks.halo}" stroke="${inks.door}" stroke-width="1.5"/>`, "too narrow"]);
  }
  for (const kind of new Set(page.floors.links.map((link) => link.kind))) {
    entries.push([`<polygon points="${linkOutline(kind, 13, 7, 5)}" fill="${inks.halo}" stroke="${inks.link}" stroke-width="2"/>`, kind]);
  }
  if (page.costs?.most) entries.push([`<defs><linearGradient id="c"><stop stop-color="#fff6b5"/><stop offset="1" stop-color="#b10026"/></linearGradient></defs>${box("url(#c)")}`, `costs 1 to ${page.costs.most}`]);
  byId("legend").replaceChildren(...entries.map(([content, text]) => element("li", {}, picture(content), text)));
}

// The ends of links on this floor, as they are drawn.
function linkMarks() {
  const { routes, floors } = page;
  const rides = routes.routes[routes.chosen]?.rides ?? [];
  return floors.ends.map(({ link, at }) => {
    const ride = rides.find((each) => each.link === link.name && (each.from === floors.at || each.to === floors.at));
    const other = ride && (ride.from === floors.at ? `to floor ${floors.nameOf(ride.to)}` : `from floor ${floors.nameOf(ride.from)}`);
    return { kind: link.kind, at, fits: link.fits, isTaken: Boolean(ride), text: link.name + (ride ? `, ${other}` : "") };
  });
}

function paint(scene) {
  const { routes, names, map, closures, floors } = page;
  const links = linkMarks();
  if (byId("show-graph").checked) paintGraph(scene, page.graph);
  if (mode() === "names" && names.chosen) paintOutline(scene, names.ownRings, names.tool === "corners");
  paintDashed(scene, routes.open, floors.at);
  paintRoutes(scene, routes.routes, routes.chosen, floors.at);
  if (byId("show-doors").checked) paintDoors(scene, map.rooms.doors);
  paintLinks(scene, links);
  const ends = floors.ends.filter(({ link }) => closures.links.includes(link.name)).map((end) => end.at);
  paintClosed(scene, { ...closures.on(floors.at), ends }, map, [...closures.draft, ...names.line]);
  const doors = byId("show-doors").checked ? map.rooms.doors.map((door) => door.at) : [];
  const [start, goal] = ["start", "goal"].map((which) => routes.here(which));
  const taken = [...doors, start, goal].filter(Boolean).map((point) => {
    const [x, y] = scene.toScreen(point);
    return [x - 8, y - 8, x + 8, y + 8];
  });
  taken.push(...links.map((mark) => linkBox(scene, mark)));
  if (byId("show-names").checked) paintNames(scene, map.rooms.rooms, taken, mode() === "names" ? names.chosen : "");
  paintEnd(scene, start, "A");
  paintEnd(scene, goal, "B");
  paintScaleBar(scene);
}

// --- pointer

async function clickedToClose(at) {
  const { scene, map, closures, floors } = page;
  const end = floors.ends.find((each) => near(scene.toScreen(each.at), at, END_REACH));
  if (end) return closures.toggle("links", end.link.name);
  const door = map.rooms.doors.find((each) => near(scene.toScreen(each.at), at, END_REACH));
  if (door) return closures.toggle("doors", door.number);
  const { room } = await page.link.post("at", { point: scene.toGrid(at) });
  return room ? closures.toggle("rooms", room) : page.say("Neither a door nor a room lies there", true);
}

const handlers = {
  grab(at) {
    if (!page.link.isLive || !page.map.ready) return null;
    if (mode() === "names") return page.names.grab(at);
    if (mode() !== "route") return null;
    for (const which of ["goal", "start"]) {
      const end = page.routes.here(which);
      if (end && near(page.scene.toScreen(end), at, END_REACH)) return { kind: "end", which };
    }
    return null;
  },
  drag(held, at) {
    const point = page.scene.toGrid(at);
    if (held.kind === "end") page.routes.setEnd(held.which, point, true);
    else page.names.drag(held, point);
  },
  drop(held, at) {
    const point = page.scene.toGrid(at);
    if (held.kind === "end") page.routes.setEnd(held.which, point);
    else page.names.drop(held, point);
  },
  click: (at) => reported(async () => {
    if (!page.link.isLive || !page.map.ready) return;
    const point = page.scene.toGrid(at);
    const { routes, closures } = page;
    if (mode() === "route") await routes.clicked(point);
    else if (mode() === "close") await clickedToClose(at);
    else if (mode() === "names") await page.names.clicked(point);
    else if (closures.draft.length > 2 && near(page.scene.toScreen(closures.draft[0]), at, END_REACH)) await closures.endArea(true);
    else closures.addCorner(point);
  })(),
  hover(at) {
    const text = at ? page.scene.textOf(page.scene.toGrid(at)) : "";
    byId("pointer").textContent = text && `${text} m`;
  },
};

// --- controls

function connectRoutes() {
  const { routes, closures } = page;
  const on = (id, kind, work) => byId(id).addEventListener(kind, reported(work));
  on("ends", "submit", () => routes.typed());
  on("preset", "change", async () => { await showCosts(); await routes.plan(); });
  on("optimum", "click", () => routes.optimum());
  on("clear", "click", () => routes.clear());
  on("alternatives", "click", () => routes.alternatives());
  on("stairs", "change", () => routes.plan());
  on("close-undo", "click", () => closures.undo());
  on("close-clear", "click", () => closures.openAll());
  on("area-done", "click", () => closures.endArea(true));
  for (const [id, kind, read] of [["close-door", "doors", Number], ["close-room", "rooms", String], ["close-link", "links", String]]) {
    on(id, "change", async () => {
      const { value } = byId(id);
      byId(id).value = "";
      if (value) await closures.toggle(kind, read(value));
    });
  }
}

function connectNames() {
  const { names } = page;
  const on = (id, kind, work) => byId(id).addEventListener(kind, reported(work));
  on("room", "change", () => names.choose(byId("room").value));
  on("rename", "submit", () => names.rename());
  on("merge", "click", () => names.merge());
  on("split", "click", () => names.use("split"));
  on("corners", "click", () => names.use("corners"));
  on("names-undo", "click", () => names.undo());
  on("save", "click", () => names.save());
  window.addEventListener("focus", () => page.map.ready && page.link.isLive && names.refresh());
}

function connectView() {
  const { scene } = page;
  const on = (id, kind, work) => byId(id).addEventListener(kind, reported(work));
  on("zoom-in", "click", () => scene.zoom(1.5));
  on("zoom-out", "click", () => scene.zoom(1 / 1.5));
  on("zoom-fit", "click", () => scene.fit());
  for (const id of ["colours", "show-graph"]) on(id, "change", async () => { await showLayer(); showLegend(); });
  on("level", "input", showLayer);
  for (const id of ["show-names", "show-doors"]) on(id, "change", () => { scene.draw(); showLegend(); });
  on("show-costs", "change", showCosts);
  on("theme", "change", useTheme);
  systemTheme.addEventListener("change", useTheme);
  on("floor", "change", () => showFloor(Number(byId("floor").value)));
  on("floor-up", "click", () => showFloor(page.floors.at + 1));
  on("floor-down", "click", () => showFloor(page.floors.at - 1));
  page.canvas.addEventListener("keydown", reported((event) => {
    const step = { PageUp: 1, PageDown: -1 }[event.key];
    return step && page.floors.isBuilding ? showFloor(page.floors.at + step) : null;
  }, false));
  document.querySelectorAll("input[name=mode]").forEach((input) => input.addEventListener("change", () => {
    page.closures.endArea(false);
    if (page.names.tool) page.names.use("");
    scene.draw();
  }));
}

// The name of a file; what is about one floor of a building has the floor in it.
function fileOf(kind) {
  if (!page.floors.isBuilding || kind === "model") return FILES[kind];
  const floor = page.floors.nameOf(page.floors.at).replaceAll(/[^\p{L}\p{N}]+/gu, "-");
  return FILES[kind].replace(".", `-${floor}.`);
}

function connectExport() {
  byId("export-png").addEventListener("click", () => {
    page.scene.paint();
    page.canvas.toBlob((blob) => download(blob, `${page.map.name}.png`));
  });
  document.querySelectorAll("[data-export]").forEach((button) => button.addEventListener("click", reported(async () => {
    const kind = button.dataset.export;
    const isPath = kind.startsWith("path");
    if (isPath && !page.routes.hasEnds) {
      page.say("Set a start and a goal first", true);
      return;
    }
    const { isBuilding, at } = page.floors;
    page.say("Writing…");
    const asked = isPath ? page.routes.query(isBuilding ? { floor: at } : {}) : null;
    const isWhole = isPath || kind === "model"; // of the building, not of a floor
    download(await page.link.file(kind, asked, isWhole ? "" : page.link.base), fileOf(kind));
    page.say("");
  })));
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape") page.closures.endArea(false);
    if (event.key === "Enter" && event.target === page.canvas && mode() === "area") page.closures.endArea(true);
    const isUndo = (event.ctrlKey || event.metaKey) && event.key === "z" && !/INPUT|SELECT/.test(event.target.tagName);
    if (isUndo && page.link.isLive) {
      event.preventDefault();
      if (mode() === "names") page.names.undo();
      else page.closures.undo();
    }
  });
}

// --- the beginning, and other floors

function describe() {
  const { map, floors } = page;
  const title = floors.title ?? map.name;
  document.title = `${title} - hybridnav`;
  byId("title").textContent = title;
  const size = [map.cols, map.rows].map((n) => n.toLocaleString("en"));
  const rooms = map.ready ? `, ${map.rooms.rooms.length} rooms` : "";
  const floor = floors.isBuilding ? `Floor ${floors.nameOf(floors.at)}: ` : "";
  byId("facts").textContent = `${floor}${size.join(" × ")} cells of ${map.resolution_m} m, robot radius ${map.robot_radius_m} m${rooms}`;
  byId("level").max = Math.max(0, map.levels.length - 1);
  byId("level").value = map.place_level ?? 0;
}

function listChoices() {
  const { map, floors } = page;
  const options = (names) => names.map((name) => element("option", { value: name }, name));
  byId("preset").replaceChildren(...options(floors.presets ?? map.presets));
  byId("close-link").replaceChildren(element("option", { value: "" }, "choose…"), ...options(floors.links.map((link) => link.name)));
}

async function showFloor(number) {
  if (!(await page.floors.show(number))) return;
  page.graph = null;
  page.closures.endArea(false);
  page.names.reset();
  describe();
  page.routes.show();
  await showLayer();
  await showCosts();
  page.say(`Floor ${page.floors.nameOf(number)}`);
  if (page.link.isLive) await page.names.refresh();
}

const pause = (milliseconds) => new Promise((done) => setTimeout(done, milliseconds));

// Show how far the server is, until there is nothing more to do or `isEnough` says so.
async function followed(isEnough) {
  for (;;) {
    const state = await page.link.get("state");
    const { stage } = state;
    byId("progress").hidden = !stage;
    byId("stage").textContent = stage ? `${stage[0].toUpperCase()}${stage.slice(1)}, ${Math.round(state.seconds)} s` : "";
    if (!stage || isEnough(state)) return;
    await pause(400);
  }
}

// The cells are there at once; rooms, places and routes come later.
async function prepared() {
  const waiting = document.querySelectorAll("[data-prepared]");
  waiting.forEach((part) => { part.inert = true; });
  byId("colours").value = "map";
  page.scene.layer = "map";
  useTheme();
  page.canvas.dataset.open = "true";
  await followed((state) => state.ready);
  page.map = await page.link.get("map");
  page.scene.map = page.map;
  waiting.forEach((part) => { part.inert = false; });
  byId("colours").value = "rooms";
  describe();
  listChoices();
  followed(() => false).catch((problem) => page.say(problem.message, true));
}

async function begin() {
  page.map = await page.floors.begin(await page.link.get("map"));
  page.scene = new Scene(page.canvas, page.map, page.link);
  page.routes = new Routes(page);
  page.names = new Names(page);
  page.scene.painters.push(paint);
  document.documentElement.classList.toggle("saved", !page.link.isLive);
  if (!page.link.isLive) page.routes.take(page.link.data.routes);
  describe();
  listChoices();
  steer(page.scene, handlers);
  connectView();
  connectRoutes();
  connectNames();
  connectExport();
  page.closures.show();
  if (!page.map.ready) await prepared();
  page.scene.version = page.map.rooms.version;
  page.names.list();
  page.names.show();
  if (page.floors.isBuilding) page.floors.note();
  await showLayer();
  useTheme();
  page.canvas.dataset.ready = "true";
}

begin().catch((problem) => page.say(problem.message, true));
