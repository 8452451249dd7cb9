// The page: connects its controls with the map, the routes and the rooms.

import { Closures } from "./closures.js";
import { Ends } from "./ends.js";
import { Floors } from "./floors.js";
import { download, openLink } from "./link.js";
import { Names } from "./names.js";
import { Pictures } from "./pictures.js";
import { Routes, element } from "./route.js";
import { Scene, steer } from "./scene.js";
import { LANGUAGES, written, remember, said, settings, t, translate } from "./texts.js";

const byId = (id) => document.getElementById(id);
const FILES = { nav2: "route-graph.geojson", model: "model.hnm", rooms: "rooms.geojson", "path-geojson": "path.geojson", "path-csv": "path.csv" };
const END_REACH = 14; // pixels
const EVERY_MS = 1000; // looks at what others have changed

const page = {
  canvas: byId("map"),
  profiles: [],
  reported,
  link: openLink(),

  // Say something; instead of nothing, why there is no route.
  say(text, isProblem = false, isDone = false) {
    const said = text || (page.routes?.refusal ?? "");
    byId("status").textContent = said.charAt(0).toUpperCase() + said.slice(1);
    byId("status").classList.toggle("problem", isProblem || !text);
    byId("status").classList.toggle("done", isDone);
  },

  showFloor,

  // What a click on the map means.
  get mode() {
    return document.querySelector("input[name=mode]:checked").value;
  },

  // Draw anew what depends on the rooms.
  async changed() {
    stateFacts();
    page.pictures.forget();
    await page.pictures.showLayer();
    page.pictures.showLegend();
    await page.routes.plan();
  },
};
page.floors = new Floors(page);
page.fields = new Ends(page);
page.closures = new Closures(page);
page.pictures = new Pictures(page);

const near = (one, other, reach) => Math.hypot(one[0] - other[0], one[1] - other[1]) < reach;

function reported(work, isOwn = true) {
  return async (event) => {
    if (isOwn) {
      event?.preventDefault?.();
      page.say(""); // what was said before is about something else
    }
    try {
      await work(event);
    } catch (problem) {
      page.say(problem.message, true);
    }
  };
}

// --- pointer

async function clickedToClose(at) {
  const { scene, names, closures, floors } = page;
  const end = floors.ends.find((each) => near(scene.toScreen(each.at), at, END_REACH));
  if (end) return closures.toggle("links", end.link.name);
  const door = names.shown.doors.find((each) => near(scene.toScreen(each.at), at, END_REACH));
  if (door) return closures.toggle("doors", door.number);
  const { room } = await page.link.post("at", { point: scene.toGrid(at) });
  return room ? closures.toggle("rooms", room) : page.say(t("nothing-there"), true);
}

const handlers = {
  grab(at) {
    if (!page.link.isLive || !page.map.ready) return null;
    if (page.mode === "names") return page.names.grab(at);
    if (page.mode !== "route") return null;
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
  drop: (held, at) => reported(async () => {
    const point = page.scene.toGrid(at);
    if (held.kind === "end") await page.routes.putEnd(held.which, point);
    else await page.names.drop(held, point);
  })(),
  click: (at) => reported(async () => {
    if (!page.map.ready || !(page.link.isLive || page.link.data.ends.length)) return;
    const point = page.scene.toGrid(at);
    const { routes, closures } = page;
    if (page.mode === "route") await (routes.hasEnds && routes.lightAt(at) ? null : routes.clicked(point));
    else if (page.mode === "close") await clickedToClose(at);
    else if (page.mode === "names") await page.names.clicked(point);
    else if (closures.draft.length > 2 && near(page.scene.toScreen(closures.draft[0]), at, END_REACH)) await closures.endArea(true);
    else closures.addCorner(point);
  })(),
  // The space bar on the middle of the map: a click, or a corner taken up and put down.
  press(at) {
    const { names } = page;
    const { lifted } = names;
    names.lifted = lifted || page.mode !== "names" ? null : handlers.grab(at);
    if (lifted) handlers.drop(lifted, at);
    else if (names.lifted) page.say(t("corner-held"));
    else handlers.click(at);
  },
  hover(at) {
    const text = at ? page.scene.textOf(page.scene.toGrid(at)) : "";
    byId("pointer").textContent = text && `${text} m`;
    if (at && page.mode === "route") page.routes.lightAt(at);
  },
};

// --- controls

function connectRoutes() {
  const { routes, closures } = page;
  const on = (id, kind, work) => byId(id).addEventListener(kind, reported(work));
  on("ends", "submit", () => routes.typed());
  on("preset", "change", async () => { await page.pictures.showCosts(); await routes.plan(); });
  on("optimum", "click", () => routes.optimum());
  for (const id of ["clear", "again"]) on(id, "click", () => routes.clear());
  on("alternatives", "click", () => routes.alternatives());
  on("stairs", "change", () => routes.plan());
  on("profile", "change", async () => {
    remember({ profile: byId("profile").value });
    routes.showProfiles();
    await routes.plan();
  });
  on("close-undo", "click", () => closures.undo());
  on("close-clear", "click", () => closures.openAll());
  on("area-start", "click", () => {
    if (byId("area-start").ariaPressed === "true") {
      closures.endArea(false);
      return;
    }
    byId("area-start").ariaPressed = "true";
    document.querySelector("input[value=area]").checked = true;
    page.say(t("click-corners"));
  });
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
  const { scene, pictures } = page;
  const on = (id, kind, work) => byId(id).addEventListener(kind, reported(work));
  on("zoom-in", "click", () => scene.zoom(1.5));
  on("zoom-out", "click", () => scene.zoom(1 / 1.5));
  on("zoom-fit", "click", () => scene.fit());
  for (const id of ["colours", "show-graph"]) on(id, "change", async () => { await pictures.showLayer(); pictures.showLegend(); });
  on("level", "input", () => pictures.showLayer());
  for (const id of ["show-names", "show-doors"]) on(id, "change", () => { scene.draw(); pictures.showLegend(); });
  on("show-all", "change", () => { page.names.list(); scene.draw(); });
  on("show-costs", "change", () => pictures.showCosts());
  on("show-heights", "change", () => pictures.showHeights());
  on("theme", "change", () => pictures.useTheme());
  on("floor", "change", () => showFloor(Number(byId("floor").value)));
  on("floor-up", "click", () => showFloor(page.floors.at + 1));
  on("floor-down", "click", () => showFloor(page.floors.at - 1));
  page.canvas.addEventListener("keydown", reported((event) => {
    const step = { PageUp: 1, PageDown: -1 }[event.key];
    return step && page.map.ready ? showFloor(page.floors.at + step) : null;
  }, false));
  on("face", "change", async () => {
    await useSettings({ face: byId("face").value });
    byId("lasting").checked = settings.face === "staff" && !byId("lasting-part").hidden;
  });
  on("language", "change", () => useSettings({ language: byId("language").value }));
  document.querySelectorAll("input[name=mode]").forEach((input) => input.addEventListener("change", () => {
    page.say("");
    byId("area-start").ariaPressed = "false"; // this choice counts
    page.closures.endArea(false);
    useMode();
    if (page.names.tool) page.names.use("");
    scene.draw();
  }));
}

// The name of a file; what is about one floor of several has the floor in it.
function fileOf(kind) {
  const floor = kind === "model" ? "" : page.floors.named(page.floors.at, (name) => `-${name.replaceAll(/[^\p{L}\p{N}]+/gu, "-")}`);
  return FILES[kind].replace(".", `${floor}.`);
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
      page.say(t("ends-first"), true);
      return;
    }
    page.say(t("writing"));
    const asked = isPath ? page.routes.query({ floor: page.floors.at }) : null;
    const isWhole = isPath || kind === "model"; // not of one floor
    download(await page.link.file(kind, asked, isWhole ? "" : page.link.base), fileOf(kind));
    page.say("");
  })));
  const undo = reported(() => (page.mode === "names" ? page.names.undo() : page.closures.undo()));
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape") {
      page.closures.endArea(false);
      if (page.names.tool) page.names.use("");
    }
    if (event.key === "Enter" && event.target === page.canvas && page.mode === "area") page.closures.endArea(true);
    const isUndo = (event.ctrlKey || event.metaKey) && event.key === "z" && !/INPUT|SELECT/.test(event.target.tagName);
    if (isUndo && page.link.isLive && page.map.ready) {
      event.preventDefault();
      undo();
    }
  });
}

// --- the beginning, and other floors

function describe() {
  const { map, floors } = page;
  document.title = `${floors.title} - hybridnav`;
  byId("title").textContent = floors.title;
  stateFacts();
  byId("level").max = Math.max(0, map.levels.length - 1);
  byId("level").value = map.place_level ?? 0;
}

// What a click means chooses what staff see; an area is a way to close something.
function useMode() {
  document.documentElement.dataset.mode = page.mode === "area" ? "close" : page.mode;
}

// Write everything anew for another face or language, which the address remembers.
async function useSettings(change) {
  remember(change);
  showSettings();
  describe();
  listChoices();
  page.names.list();
  page.names.show();
  page.closures.show();
  page.pictures.showLegend();
  page.routes.showEnds();
  page.routes.show();
  await page.pictures.showLayer();
  await page.routes.plan(); // its words
}

function showSettings() {
  document.documentElement.dataset.face = settings.face;
  byId("face").value = settings.face;
  byId("language").replaceChildren(...Object.entries(LANGUAGES).map(([value, name]) => element("option", { value }, name)));
  byId("language").value = settings.language;
  if (settings.face === "staff" && page.mode === "area") document.querySelector("input[value=close]").checked = true;
  useMode();
  translate();
}

// State what is shown, below its name.
function stateFacts() {
  const { map, floors } = page;
  const facts = [];
  if (settings.face === "robot") facts.push(t("facts-robot", written(map.cols), written(map.rows), map.resolution_m, map.robot_radius_m));
  if (map.ready) facts.push(t("facts-rooms", page.names.shown.rooms.length));
  byId("facts").textContent = floors.named(floors.at, (name) => t("facts-floor", name, facts.join(", "))) || facts.join(", ");
}

function listChoices() {
  const { floors } = page;
  const options = (names) => names.map((name) => element("option", { value: name }, name));
  const preset = byId("preset").value;
  byId("preset").replaceChildren(...options(floors.presets));
  if (preset) byId("preset").value = preset;
  page.routes.showProfiles();
  byId("close-link").replaceChildren(element("option", { value: "" }, t("choose")), ...options(floors.links.map((link) => link.name)));
}

async function showFloor(number) {
  if (!(await page.floors.show(number))) return;
  page.pictures.forget();
  page.closures.endArea(false);
  page.names.reset();
  describe();
  page.routes.show();
  await page.pictures.showLayer();
  await page.pictures.showCosts();
  if (page.link.isLive) await page.names.refresh();
}

const pause = (milliseconds) => new Promise((done) => setTimeout(done, milliseconds));

// Show how far the server is, until there is nothing more to do or `isEnough` says so.
async function followed(isEnough) {
  for (;;) {
    const state = await page.link.get("state", "");
    const { stage } = state;
    byId("progress").hidden = !stage;
    const text = said(stage);
    byId("stage").textContent = text ? `${text[0].toUpperCase()}${text.slice(1)}, ${t("seconds", Math.round(state.seconds))}` : "";
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
  page.pictures.useTheme();
  page.canvas.dataset.open = "true";
  await followed((state) => state.ready);
  page.map = await page.floors.begin(await page.link.get("map", ""));
  page.scene.map = page.map;
  waiting.forEach((part) => { part.inert = false; });
  byId("colours").value = "rooms";
  describe();
  listChoices();
  followed(() => false).catch((problem) => page.say(problem.message, true));
}

// Look at what others change, while somebody sees the page.
async function watched() {
  for (let told = ""; ;) {
    await pause(EVERY_MS);
    if (document.hidden) continue;
    try {
      await page.closures.look();
      told = "";
    } catch ({ code, message }) {
      if (code && message !== told) page.say(message, true); // a server that has ended is no news
      told = message;
    }
  }
}

async function begin() {
  showSettings();
  const whole = await page.link.get("map", "");
  page.map = await page.floors.begin(whole);
  page.scene = new Scene(page.canvas, page.map, page.link);
  page.routes = new Routes(page);
  page.names = new Names(page);
  page.scene.painters.push((scene) => page.pictures.paint(scene));
  document.documentElement.classList.toggle("saved", !page.link.isLive);
  document.documentElement.classList.toggle("mute", !page.link.isLive && !page.link.data.ends.length);
  if (!page.link.isLive) page.routes.take(page.link.routes);
  describe();
  listChoices();
  steer(page.scene, handlers);
  connectView();
  connectRoutes();
  connectNames();
  connectExport();
  page.fields.connect(reported);
  page.closures.show();
  if (!page.map.ready || !whole.ready) await prepared();
  page.scene.version = page.map.rooms.version;
  page.names.list();
  page.names.show();
  page.floors.note();
  await page.pictures.showLayer();
  page.pictures.useTheme();
  if (page.link.isLive) {
    await page.fields.begin();
    await page.closures.begin();
    page.routes.showProfiles();
    watched();
  }
  page.canvas.dataset.ready = "true";
}

begin().catch((problem) => page.say(problem.message, true));
