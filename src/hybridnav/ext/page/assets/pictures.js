// What the map shows: its colours, the graph and costs over them, marks, names, and the legend.

import { inksOf, linkBoxes, linkOutline, litBoxes, paintClosed, paintDashed, paintDoors, paintEnd, paintGraph, paintLinks, paintLit, paintMiddle, paintNames, paintNumbers, paintOutline, paintRoutes, paintScaleBar, paintWays } from "./draw.js";
import { element, picture } from "./route.js";
import { written, settings, t } from "./texts.js";

const NUMBERS_FROM = 11; // pixels per metre from which numbers of doors are read
const systemTheme = matchMedia("(prefers-color-scheme: dark)");

export class Pictures {
  #graph = null;
  #costs = null;
  #heights = null; // that are shown: the greatest in metres, and the goal of their proof
  #asked = 0;

  constructor(page) {
    this.page = page;
    this.byId = (id) => document.getElementById(id);
    systemTheme.addEventListener("change", () => this.useTheme());
  }

  useTheme() {
    const chosen = this.byId("theme").value;
    const theme = chosen === "auto" ? (systemTheme.matches ? "dark" : "light") : chosen;
    this.page.scene.theme = theme;
    document.documentElement.dataset.theme = theme;
    document.documentElement.style.colorScheme = theme;
    this.page.routes.show();
    this.showLegend();
  }

  // Forget the graph of places: other rooms, or another floor, have another one.
  forget() {
    this.#graph = null;
  }

  async showLayer() {
    const { map, link, scene } = this.page;
    const colours = this.byId("colours").value;
    const level = this.byId("level").value;
    this.byId("level-row").hidden = colours !== "level" || !link.isLive;
    scene.layer = colours === "level" ? `level-${level}` : colours;
    const facts = map.levels[level];
    this.byId("level-text").textContent = `${level}${facts.name ? ` (${t(`level-${facts.name}`)})` : ""}`;
    this.byId("level").setAttribute("aria-valuetext", t("level-is", level, facts.vertices, facts.arcs));
    scene.draw();
    const wanted = colours === "level" ? level : String(map.place_level);
    const isWanted = this.byId("show-graph").checked;
    this.byId("level-note").textContent = "";
    const number = (this.#asked += 1);
    if (!isWanted) return;
    if (this.#graph?.level !== Number(wanted)) {
      const graph = await link.get(`graph/${wanted}`);
      if (number !== this.#asked) return; // another one is wanted meanwhile
      this.#graph = graph;
    }
    if (!this.#graph.drawn) this.byId("level-note").textContent = t("level-full", wanted, written(this.#graph.vertices));
    scene.draw();
  }

  async showCosts() {
    const { scene, link } = this.page;
    scene.overlay = null;
    this.#costs = null;
    if (this.byId("show-costs").checked) {
      const preset = this.byId("preset").value;
      this.#costs = await link.get(`costs/${preset}`);
      if (this.#costs.most === null) this.page.say(t("no-costs", preset), true);
      else scene.overlay = `costs-${preset}`;
    }
    this.showLegend();
    scene.draw();
  }

  // In a saved page: the heights of the proof of a start, which it has for the rooms of a map.
  async showHeights() {
    const { scene, link, routes } = this.page;
    if (link.isLive) return;
    const heights = await link.get("heights");
    this.byId("heights-row").hidden = !Object.keys(heights).length;
    const number = link.numberOf(routes.ends.start);
    this.#heights = this.byId("show-heights").checked ? heights[number] : null;
    scene.overlay = this.#heights ? `heights-${number}` : null;
    this.showLegend();
    scene.draw();
  }

  showLegend() {
    const { map, scene, floors } = this.page;
    const colours = map.colours[scene.theme];
    const inks = inksOf(scene);
    const box = (colour) => `<rect x="1" y="1" width="24" height="12" fill="${colour}" stroke="${inks.rim}"/>`;
    const three = (first) => [0, 1, 2].map((n) => `<rect x="${1 + 8 * n}" y="1" width="8" height="12" fill="${colours[first + n]}"/>`).join("");
    const line = (colour, dash = "") => `<path d="M1 7h24" stroke="${colour}" stroke-width="2" stroke-dasharray="${dash}"/>`;
    const shown = this.byId("colours").value;
    const entries = [[box(colours[0]), t("free")], [box(colours[1]), t("unexplored")], [box(colours[2]), t("within", map.robot_radius_m)], [box(colours[3]), t("occupied")]];
    if (shown !== "map") entries.push([three(4), t(shown === "rooms" ? "colours-rooms" : "free-places")]);
    if (shown === "level") entries.push([three(10), t("unexplored-places")]);
    if (this.byId("show-graph").checked) {
      entries.push([`${line(inks.free)}<circle cx="5" cy="7" r="3.5" fill="${inks.ink}"/>`, t("place-arc")], [line(inks.loop, "4 2"), t("self-loop")]);
    }
    if (this.byId("show-doors").checked) {
      entries.push([`<circle cx="13" cy="7" r="5" fill="${inks.door}"/>`, t("a-door")], [`<rect x="8" y="2" width="10" height="10" fill="${inks.door}"/>`, t("an-opening")],
        [`<circle cx="13" cy="7" r="4.5" fill="${inks.halo}" stroke="${inks.door}" stroke-width="1.5"/>`, t("too-narrow")]);
    }
    for (const kind of new Set(floors.links.map((link) => link.kind))) {
      entries.push([`<polygon points="${linkOutline(kind, 13, 7, 5)}" fill="${inks.halo}" stroke="${inks.link}" stroke-width="2"/>`, t(kind)]);
    }
    const most = this.#costs?.most;
    if (most) entries.push([`<defs><linearGradient id="c"><stop stop-color="#fff6b5"/><stop offset="1" stop-color="#b10026"/></linearGradient></defs>${box("url(#c)")}`, t("costs-to", Number(most.toPrecision(3)))]);
    if (this.#heights) entries.push([`<defs><linearGradient id="h"><stop stop-color="#440154"/><stop offset=".5" stop-color="#21918c"/><stop offset="1" stop-color="#fde725"/></linearGradient></defs>${box("url(#h)")}`, t("heights-to", ...this.#heights)]);
    this.byId("legend").replaceChildren(...entries.map(([content, text]) => element("li", {}, picture(content), text)));
  }

  // The ends of links on this floor, as they are drawn.
  #linkMarks() {
    const { routes, floors } = this.page;
    const rides = routes.routes[routes.chosen]?.rides ?? [];
    return floors.ends.map(({ link, at }) => {
      const ride = rides.find((each) => each.link === link.name && (each.from === floors.at || each.to === floors.at));
      const isLeft = ride?.from === floors.at;
      const where = ride ? [t(isLeft ? "to-floor" : "from-floor", floors.nameOf(isLeft ? ride.to : ride.from))] : [];
      return { kind: link.kind, at, fits: link.fits, isTaken: Boolean(ride), texts: [link.label, ...where] };
    });
  }

  paint(scene) {
    const { routes, names, closures, floors } = this.page;
    const links = this.#linkMarks();
    const isNaming = this.page.mode === "names";
    const isRobot = settings.face === "robot";
    const hasDoors = this.byId("show-doors").checked || !isRobot;
    const shown = names.shown;
    const listed = hasDoors ? shown.doors : [];
    if (isRobot && this.byId("show-graph").checked) paintGraph(scene, this.#graph);
    if (isNaming && names.chosen) paintOutline(scene, names.ownRings, names.tool === "corners");
    paintDashed(scene, routes.open, floors.at);
    paintRoutes(scene, routes.routes, routes.chosen, floors.at);
    paintDoors(scene, listed);
    paintLinks(scene, links);
    const ends = floors.ends.filter(({ link }) => [link.name, `${link.name}@${floors.names[floors.at]}`].some((name) => closures.links.includes(name))).map((end) => end.at);
    const crosses = [...closures.marks, ...ends];
    paintClosed(scene, closures.areas, crosses, [...closures.draft, ...names.line]);
    paintWays(scene, closures.ways);
    const [start, goal] = ["start", "goal"].map((which) => routes.here(which));
    const taken = [...listed.map((door) => door.at), ...crosses, start, goal].filter(Boolean).map((point) => {
      const [x, y] = scene.toScreen(point);
      return [x - 8, y - 8, x + 8, y + 8];
    });
    const lit = routes.spotOf(routes.lines[routes.lit]);
    taken.push(...links.flatMap((mark) => linkBoxes(scene, mark)), ...(lit ? litBoxes(scene, lit) : []));
    const isTold = (door) => names.isTold(door);
    paintNumbers(scene, listed.filter(isTold), taken);
    if (!isRobot || this.byId("show-names").checked) paintNames(scene, shown.rooms, taken, isNaming ? names.chosen : "");
    if (scene.scale / scene.map.resolution_m >= NUMBERS_FROM) paintNumbers(scene, listed.filter((door) => !isTold(door)), taken);
    paintEnd(scene, start, "A");
    paintEnd(scene, goal, "B");
    if (lit) paintLit(scene, lit);
    if (scene.canvas.matches(":focus-visible")) paintMiddle(scene);
    paintScaleBar(scene);
  }
}
