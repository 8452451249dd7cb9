// Where the page's data come from: the server behind it, or the file that it was saved in.

import { said, t } from "./texts.js";

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

  firstZoom() {
    return 0;
  }

  tileAddress(layer, { zoom, row, col, theme, version }) {
    return `${this.base}tile/${layer}/${zoom}/${row}/${col}.png?theme=${theme}&version=${version}`;
  }
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
    throw new Failure(t("not-in-file"), 404);
  }

  firstZoom(layer) {
    return this.#about(this.base).tiles[layer]?.first ?? 0;
  }

  tileAddress(layer, { zoom, row, col, theme }) {
    return this.#about(this.base).tiles[layer]?.found[`${theme}/${zoom}/${row}/${col}`];
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
