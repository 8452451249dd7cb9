// The page: connects its controls with the map, the routes and the rooms.

import { inksOf, paintClosed, paintDashed, paintDoors, paintEnd, paintGraph, paintNames, paintOutline, paintRoutes, paintScaleBar } from "./draw.js";
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

const mode = () => document.querySelector("input[name=mode]:checked").value;
const near = (one, other, reach) => Math.hypot(one[0] - other[0], one[1] - other[1]) < reach;

function reported(work) {
  return async (event) => {
    event?.preventDefault?.();
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
  if (page.costs?.most) entries.push([`<defs><linearGradient id="c"><stop stop-color="#fff6b5"/><stop offset="1" stop-color="#b10026"/></linearGradient></defs>${box("url(#c)")}`, `costs 1 to ${page.costs.most}`]);
  byId("legend").replaceChildren(...entries.map(([content, text]) => element("li", {}, picture(content), text)));
}

function paint(scene) {
  const { routes, names, map } = page;
  if (byId("show-graph").checked) paintGraph(scene, page.graph);
  if (mode() === "names" && names.chosen) paintOutline(scene, names.ownRings, names.tool === "corners");
  paintDashed(scene, routes.open?.line);
  paintRoutes(scene, routes.routes, routes.chosen);
  if (byId("show-doors").checked) paintDoors(scene, map.rooms.doors);
  paintClosed(scene, routes.closed, map, [...routes.draft, ...names.line]);
  const doors = byId("show-doors").checked ? map.rooms.doors.map((door) => door.at) : [];
  const taken = [...doors, routes.start, routes.goal].filter(Boolean).map((point) => {
    const [x, y] = scene.toScreen(point);
    return [x - 8, y - 8, x + 8, y + 8];
  });
  if (byId("show-names").checked) paintNames(scene, map.rooms.rooms, taken, mode() === "names" ? names.chosen : "");
  paintEnd(scene, routes.start, "A");
  paintEnd(scene, routes.goal, "B");
  paintScaleBar(scene);
}

// --- pointer

async function clickedToClose(at) {
  const { scene, map, routes } = page;
  const door = map.rooms.doors.find((each) => near(scene.toScreen(each.at), at, END_REACH));
  if (door) return routes.close("doors", door.number);
  const { room } = await page.link.post("at", { point: scene.toGrid(at) });
  return room ? routes.close("rooms", room) : page.say("Neither a door nor a room lies there", true);
}

const handlers = {
  grab(at) {
    if (!page.link.isLive) return null;
    if (mode() === "names") return page.names.grab(at);
    if (mode() !== "route") return null;
    for (const which of ["goal", "start"]) {
      const end = page.routes[which];
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
    if (!page.link.isLive) return;
    const point = page.scene.toGrid(at);
    const { routes } = page;
    if (mode() === "route") await routes.clicked(point);
    else if (mode() === "close") await clickedToClose(at);
    else if (mode() === "names") await page.names.clicked(point);
    else if (routes.draft.length > 2 && near(page.scene.toScreen(routes.draft[0]), at, END_REACH)) routes.endArea(true);
    else routes.addCorner(point);
  })(),
  hover(at) {
    const text = at ? page.scene.textOf(page.scene.toGrid(at)) : "";
    byId("pointer").textContent = text && `${text} m`;
  },
};

// --- controls

function connectRoutes() {
  const { routes } = page;
  const on = (id, kind, work) => byId(id).addEventListener(kind, reported(work));
  on("ends", "submit", () => routes.typed());
  on("preset", "change", async () => { await showCosts(); await routes.plan(); });
  on("optimum", "click", () => routes.optimum());
  on("clear", "click", () => routes.clear());
  on("alternatives", "click", () => routes.alternatives());
  on("close-undo", "click", () => routes.undoClosed());
  on("close-clear", "click", () => routes.openAll());
  on("area-done", "click", () => routes.endArea(true));
  for (const [id, kind, read] of [["close-door", "doors", Number], ["close-room", "rooms", String]]) {
    on(id, "change", async () => {
      const { value } = byId(id);
      byId(id).value = "";
      if (value) await routes.close(kind, read(value));
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
  window.addEventListener("focus", () => names.refresh());
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
  document.querySelectorAll("input[name=mode]").forEach((input) => input.addEventListener("change", () => {
    page.routes.endArea(false);
    if (page.names.tool) page.names.use("");
    scene.draw();
  }));
}

function connectExport() {
  byId("export-png").addEventListener("click", () => {
    page.scene.paint();
    page.canvas.toBlob((blob) => download(blob, `${page.map.name}.png`));
  });
  document.querySelectorAll("[data-export]").forEach((button) => button.addEventListener("click", reported(async () => {
    const kind = button.dataset.export;
    if (kind.startsWith("path") && !(page.routes.start && page.routes.goal)) {
      page.say("Set a start and a goal first", true);
      return;
    }
    page.say("Writing…");
    download(await page.link.file(kind, kind.startsWith("path") ? page.routes.query() : null), FILES[kind]);
    page.say("");
  })));
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape") page.routes.endArea(false);
    if (event.key === "Enter" && event.target === page.canvas && mode() === "area") page.routes.endArea(true);
    const isUndo = (event.ctrlKey || event.metaKey) && event.key === "z" && !/INPUT|SELECT/.test(event.target.tagName);
    if (isUndo && page.link.isLive) {
      event.preventDefault();
      if (mode() === "names") page.names.undo();
      else page.routes.undoClosed();
    }
  });
}

function describeMap() {
  const { map } = page;
  document.title = `${map.name} - hybridnav`;
  byId("title").textContent = map.name;
  const size = [map.cols, map.rows].map((n) => n.toLocaleString("en"));
  byId("facts").textContent = `${size.join(" × ")} cells of ${map.resolution_m} m, robot radius ${map.robot_radius_m} m, ${map.rooms.rooms.length} rooms`;
  byId("preset").replaceChildren(...map.presets.map((name) => element("option", { value: name }, name)));
  byId("level").max = map.levels.length - 1;
  byId("level").value = map.place_level;
  byId("floor").replaceChildren(...map.floors.map((name) => element("option", { value: name }, name)));
  byId("floor-row").hidden = map.floors.length < 2;
}

async function begin() {
  page.map = await page.link.get("map");
  page.scene = new Scene(page.canvas, page.map, page.link);
  page.scene.version = page.map.rooms.version;
  page.routes = new Routes(page);
  page.names = new Names(page);
  page.scene.painters.push(paint);
  document.documentElement.classList.toggle("saved", !page.link.isLive);
  if (!page.link.isLive) Object.assign(page.routes, { routes: page.link.data.routes, start: page.link.data.routes[0]?.start, goal: page.link.data.routes[0]?.goal });
  describeMap();
  steer(page.scene, handlers);
  connectView();
  connectRoutes();
  connectNames();
  connectExport();
  page.names.list();
  page.names.show();
  page.routes.showClosed();
  await showLayer();
  useTheme();
  page.canvas.dataset.ready = "true";
}

begin().catch((problem) => page.say(problem.message, true));
