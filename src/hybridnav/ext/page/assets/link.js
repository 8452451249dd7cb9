// Where the page's data come from: the server behind it, or the file that it was saved in.

import { said, settings, t } from "./texts.js";

export class Failure extends Error {
  constructor(message, code) {
    super(message);
    this.code = code;
  }
}

export class LiveLink {
  isLive = true;
  base = "floor/0/"; // before the names of what is about one floor

  async #fetched(path, options) {
    let response;
    try {
      response = await fetch(path, options);
    } catch {
      throw new Failure(t("no-server"), 0);
    }
    if (response.ok) return response;
    const answer = await response.json().catch(() => ({}));
    throw new Failure(answer.error ? said(answer.error) : t("error", response.status), response.status);
  }

  async get(name, base = this.base) {
    return (await this.#fetched(`${base}${name}.json`)).json();
  }

  #posted(name, body) {
    const headers = { "content-type": "application/json" };
    return this.#fetched(name, { method: "POST", headers, body: JSON.stringify(body) });
  }

  async post(name, body, base = this.base) {
    return (await this.#posted(base + name, body)).json();
  }

  async file(kind, body, base = this.base) {
    return (await this.#posted(`${base}export/${kind}`, body)).blob();
  }

  zooms(_, last) {
    return { first: 0, last };
  }

  tileAddress(layer, { zoom, row, col, theme, version }) {
    return `${this.base}tile/${layer}/${zoom}/${row}/${col}.png?theme=${theme}&version=${version}`;
  }
}

const folded = (text) => text.normalize("NFKD").replaceAll(/\p{M}/gu, "").toLowerCase().trim().replaceAll(/\s+/g, " ");

function inLanguage(route) {
  return { ...route, why: route.why[settings.language], words: route.words[settings.language] };
}

export class SavedLink {
  isLive = false;
  base = "floor/0/";

  constructor(data) {
    this.data = data;
  }

  #about(base) {
    return base ? this.data.floors[Number(base.split("/")[1])] : this.data;
  }

  async get(name, base = this.base) {
    if (name === "map") return this.#about(base).map;
    if (name.startsWith("graph/")) return this.#about(base).graph;
    if (name === "heights") return this.#about(base).heights ?? {};
    throw new Failure(t("not-in-file"), 404);
  }

  // What the file has of the queries of a server: rooms by name or point, and routes between them.
  async post(name, { text, point, name: called, start, goal }, base = this.base) {
    const { ends, matrix } = this.data;
    const floor = Number(base.split("/")[1]);
    if (name === "find") return { found: this.#found(text) };
    if (name === "stand") {
      const wanted = called ?? this.#roomAt(floor, point);
      return ends.find((end) => end.floor === floor && end.name === wanted) ?? { name: null };
    }
    const route = name === "plan" && matrix[this.numberOf(start)]?.[this.numberOf(goal)];
    if (!route) throw new Failure(t("not-in-file"), 404);
    return inLanguage(route);
  }

  // The number of an end that is a room of the file, -1 for others.
  numberOf(end) {
    return this.data.ends.findIndex(({ floor, name }) => floor === end?.floor && name === end.name);
  }

  get routes() {
    return this.data.routes.map(inLanguage);
  }

  #found(text) {
    const { floors } = this.data.map;
    const [before, colon, after] = text.includes(":") ? [text.split(":")[0], ":", text.split(":").slice(1).join(":")] : ["", "", text];
    const onFloor = colon ? floors.findIndex((name) => folded(name) === folded(before)) : -1;
    const wanted = folded(onFloor < 0 ? text : after);
    return this.data.ends
      .filter((end) => (onFloor < 0 || end.floor === onFloor) && wanted.split(" ").every((word) => folded(end.name).includes(word)))
      .map(({ floor, name }) => ({ floor, name, same: folded(name) === wanted, favourite: false }))
      .sort((one, other) => other.same - one.same || one.name.localeCompare(other.name, undefined, { numeric: true }));
  }

  // The room whose outline holds a point: a ray from there crosses it an odd number of times.
  #roomAt(floor, [x, y]) {
    const { map, rings } = this.data.floors[floor];
    const isIn = (ring) => ring.filter(([x1, y1], at) => {
      const [x2, y2] = ring[(at + 1) % ring.length];
      return (y1 > y) !== (y2 > y) && x < x1 + ((y - y1) * (x2 - x1)) / (y2 - y1);
    }).length % 2;
    return map.rooms.rooms[rings.findIndex((room) => room.filter(isIn).length % 2)]?.name;
  }

  zooms(layer, last) {
    return this.#about(this.base).tiles[layer] ?? { first: 0, last };
  }

  tileAddress(layer, { zoom, row, col, theme }) {
    const found = this.#about(this.base).tiles[layer]?.found;
    return found?.[`${theme}/${zoom}/${row}/${col}`] ?? found?.[`light/${zoom}/${row}/${col}`];
  }
}

export function openLink() {
  const saved = document.getElementById("saved");
  return saved ? new SavedLink(JSON.parse(saved.textContent)) : new LiveLink();
}

export function download(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
