// The view of the map on its canvas: where it is, and the tiles under everything else.
// Points are [column, row] in grid units, row 0 at the bottom.

const TILE = 256;
const MOST_TILES = 600;
const LEAST_SCALE = 0.005;
const MOST_SCALE = 64;
const [ABOVE, BELOW] = [56, 52]; // pixels that the controls and the scale bar take

export class Scene {
  middle = [0, 0];
  scale = 1; // CSS pixels per cell
  #isWhole = true; // all of the map is shown, and stays so when the window changes
  width = 0;
  height = 0;
  painters = [];
  #tiles = new Map();
  #ground = document.createElement("canvas");
  #seen = ""; // what the ground shows
  #arrived = 0; // tiles
  #isDue = false;

  constructor(canvas, map, link) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.map = map;
    this.link = link;
    this.theme = "light";
    this.layer = "rooms";
    this.overlay = null;
    this.version = 0;
    new ResizeObserver(() => this.#resize()).observe(canvas);
    this.#resize();
    this.fit();
  }

  #resize() {
    const ratio = window.devicePixelRatio || 1;
    this.ratio = ratio;
    this.width = this.canvas.clientWidth;
    this.height = this.canvas.clientHeight;
    this.canvas.width = Math.round(this.width * ratio);
    this.canvas.height = Math.round(this.height * ratio);
    if (this.#isWhole) this.fit();
    else this.draw();
  }

  get place() {
    return this.#isWhole ? null : { middle: this.middle, scale: this.scale };
  }

  // Show another map, all of it or as it was seen last.
  show(map, place) {
    this.map = map;
    this.version = map.rooms.version;
    if (place) this.#move(place);
    else this.fit();
  }

  fit() {
    const [left, right, bottom, top] = this.map.known;
    this.#fit(left, right, bottom, top);
    this.#isWhole = true;
  }

  // Fit a box between the controls above and the scale bar below.
  #fit(left, right, bottom, top) {
    const [wide, high] = [0.94 * this.width, Math.max(this.height - ABOVE - BELOW, 0.5 * this.height)];
    const scale = this.#clamped(Math.min(wide / (right - left), high / (top - bottom)));
    const down = (Math.min(ABOVE, this.height / 4) - Math.min(BELOW, this.height / 4)) / 2;
    this.#move({ middle: [(left + right) / 2, (bottom + top) / 2 + down / scale], scale });
  }

  // Show all of a line, unless it can be seen as it is.
  frame(points) {
    const isIn = ([x, y]) => x > 20 && y > ABOVE && x < this.width - 20 && y < this.height - BELOW;
    const [[left, right], [bottom, top]] = [0, 1].map((axis) => points.map((point) => point[axis])).map((values) => [Math.min(...values), Math.max(...values)]);
    const least = 6 / this.map.resolution_m; // cells: a short way is seen with what lies round it
    const isSmall = Math.max(right - left, top - bottom, least) * this.scale < 100;
    if (points.every((point) => isIn(this.toScreen(point))) && !isSmall) return;
    this.#fit(left - least / 2, right + least / 2, bottom - least / 2, top + least / 2);
  }

  // Move a point into view, unless it is.
  reveal(point) {
    const [x, y] = this.toScreen(point);
    if (x < 20 || y < 20 || x > this.width - 20 || y > this.height - 40) this.#move({ middle: point });
  }

  #move(place) {
    Object.assign(this, place);
    this.#isWhole = false;
    this.draw();
  }

  #clamped(scale) {
    return Math.min(MOST_SCALE, Math.max(LEAST_SCALE, scale || 1));
  }

  toScreen([x, y]) {
    return [
      this.width / 2 + (x - this.middle[0]) * this.scale,
      this.height / 2 - (y - this.middle[1]) * this.scale,
    ];
  }

  toGrid([left, top]) {
    return [
      this.middle[0] + (left - this.width / 2) / this.scale,
      this.middle[1] - (top - this.height / 2) / this.scale,
    ];
  }

  toMetres([x, y]) {
    const { origin, along, up } = this.map.frame;
    return [origin[0] + x * along[0] + y * up[0], origin[1] + x * along[1] + y * up[1]];
  }

  fromMetres([x, y], map = this.map) {
    const { origin, along, up } = map.frame;
    const area = along[0] * up[1] - along[1] * up[0];
    const [dx, dy] = [x - origin[0], y - origin[1]];
    return [(dx * up[1] - dy * up[0]) / area, (dy * along[0] - dx * along[1]) / area];
  }

  // A point in whole centimetres, or in fifths of finer cells: what the panel shows is what is meant.
  rounded(point) {
    const text = this.textOf(point).split(", ");
    return this.fromMetres(text.map(Number));
  }

  textOf(point) {
    const decimals = Math.max(2, Math.ceil(-Math.log10(this.map.resolution_m / 5)));
    return this.toMetres(point).map((value) => value.toFixed(decimals)).join(", ");
  }

  pan(right, down) {
    this.#move({ middle: [this.middle[0] - right / this.scale, this.middle[1] + down / this.scale] });
  }

  zoom(factor, at = [this.width / 2, this.height / 2]) {
    const held = this.toGrid(at);
    this.scale = this.#clamped(this.scale * factor);
    const now = this.toGrid(at);
    this.#move({ middle: [this.middle[0] + held[0] - now[0], this.middle[1] + held[1] - now[1]] });
  }

  draw() {
    if (this.#isDue) return;
    this.#isDue = true;
    requestAnimationFrame(() => {
      this.#isDue = false;
      this.paint();
    });
  }

  paint() {
    const { context, ratio } = this;
    this.#paintGround();
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    context.drawImage(this.#ground, 0, 0);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    for (const painter of this.painters) painter(this);
    this.canvas.dataset.view = [...this.middle, this.scale].join(" ");
    this.canvas.dataset.waiting = [...this.#tiles.values()].filter((t) => !t.isReady).length;
  }

  // The tiles, kept as one picture while nothing of them changes: a dragged route moves over them.
  #paintGround() {
    const { ratio } = this;
    const { width, height } = this.canvas;
    const seen = [...this.middle, this.scale, width, height, this.layer, this.overlay, this.theme, this.version, this.link.base, this.#arrived].join(" ");
    if (seen === this.#seen) return;
    this.#seen = seen;
    Object.assign(this.#ground, { width, height }); // also clears it
    const ground = this.#ground.getContext("2d");
    const [left, top] = this.toScreen([0, this.map.rows]).map((v) => Math.round(v * ratio));
    const [right, bottom] = this.toScreen([this.map.cols, 0]).map((v) => Math.round(v * ratio));
    ground.beginPath();
    ground.rect(left, top, right - left, bottom - top);
    ground.clip();
    this.#paintTiles(ground, this.layer, true);
    if (this.overlay) this.#paintTiles(ground, this.overlay, false);
  }

  #paintTiles(ground, layer, isOpaque) {
    const { first, last } = this.link.zooms(layer, this.map.zooms - 1);
    const wanted = Math.floor(-Math.log2(this.scale * this.ratio));
    const zoom = Math.max(first, Math.min(Math.max(last, first), wanted));
    if (isOpaque && zoom < last) this.#paintZoom(ground, layer, last); // seen until finer tiles arrive
    this.#paintZoom(ground, layer, zoom);
  }

  #paintZoom(context, layer, zoom) {
    const { ratio } = this;
    const side = TILE * 2 ** zoom;
    const [west, north] = this.toGrid([0, 0]);
    const [east, south] = this.toGrid([this.width, this.height]);
    const lastRow = Math.min(Math.floor(north / side), Math.ceil(this.map.rows / side) - 1);
    const lastCol = Math.min(Math.floor(east / side), Math.ceil(this.map.cols / side) - 1);
    context.imageSmoothingEnabled = this.scale * ratio * 2 ** zoom < 1;
    context.imageSmoothingQuality = "high";
    context.setTransform(1, 0, 0, -1, 0, 0); // row 0 of a tile is the lowest
    for (let row = Math.max(0, Math.floor(south / side)); row <= lastRow; row++) {
      for (let col = Math.max(0, Math.floor(west / side)); col <= lastCol; col++) {
        const tile = this.#tile(layer, zoom, row, col);
        if (!tile?.isReady) continue;
        const [wide, high] = [tile.image.width * 2 ** zoom, tile.image.height * 2 ** zoom];
        const from = this.toScreen([col * side, row * side]).map((v) => Math.round(v * ratio));
        const to = this.toScreen([col * side + wide, row * side + high])
          .map((v) => Math.round(v * ratio));
        context.drawImage(tile.image, from[0], -from[1], to[0] - from[0], from[1] - to[1]);
      }
    }
    context.setTransform(1, 0, 0, 1, 0, 0);
  }

  #tile(layer, zoom, row, col) {
    const { theme, version } = this;
    const address = this.link.tileAddress(layer, { zoom, row, col, theme, version });
    if (!address) return null;
    let tile = this.#tiles.get(address);
    if (tile) {
      this.#tiles.delete(address); // the last used stands last
    } else {
      tile = { image: new Image(), isReady: false };
      tile.image.onload = () => { tile.isReady = true; this.#arrived += 1; this.draw(); };
      tile.image.onerror = () => { this.#tiles.delete(address); };
      tile.image.src = address;
    }
    this.#tiles.set(address, tile);
    if (this.#tiles.size > MOST_TILES) this.#tiles.delete(this.#tiles.keys().next().value);
    return tile;
  }
}

// Connect a scene with pointer, wheel and keys; `handlers` decide what a click or drag means.
export function steer(scene, handlers) {
  const { canvas } = scene;
  const pointers = new Map();
  let held = null;
  let moved = 0;
  const at = (event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, at(event));
    moved = 0;
    if (pointers.size === 1) held = handlers.grab(at(event));
  });
  canvas.addEventListener("pointermove", (event) => {
    const [before, now] = [pointers.get(event.pointerId), at(event)];
    handlers.hover(now);
    if (!before) return;
    moved += Math.hypot(now[0] - before[0], now[1] - before[1]);
    if (pointers.size === 2) {
      const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
      const apart = (point) => Math.hypot(point[0] - other[0], point[1] - other[1]);
      scene.zoom(apart(now) / Math.max(1, apart(before)), other);
    } else if (held && moved > 2) {
      handlers.drag(held, now);
    } else if (moved > 4) {
      scene.pan(now[0] - before[0], now[1] - before[1]);
    }
    pointers.set(event.pointerId, now);
  });
  const release = (event) => {
    if (!pointers.delete(event.pointerId) || pointers.size) return;
    if (held && moved > 2) handlers.drop(held, at(event));
    else if (moved <= 4 && event.type === "pointerup") handlers.click(at(event));
    held = null;
  };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("pointerleave", () => handlers.hover(null));
  for (const kind of ["focus", "blur"]) canvas.addEventListener(kind, () => scene.draw());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 24 : 1;
    scene.zoom(1.0016 ** -(event.deltaY * lines), at(event));
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const step = event.shiftKey ? 8 : 80;
    const actions = {
      ArrowLeft: () => scene.pan(step, 0), ArrowRight: () => scene.pan(-step, 0),
      ArrowUp: () => scene.pan(0, step), ArrowDown: () => scene.pan(0, -step),
      "+": () => scene.zoom(1.4), "=": () => scene.zoom(1.4),
      "-": () => scene.zoom(1 / 1.4), 0: () => scene.fit(),
      " ": () => handlers.press([scene.width / 2, scene.height / 2]),
    };
    if (event.ctrlKey || event.metaKey || !actions[event.key]) return;
    event.preventDefault();
    actions[event.key]();
  });
}
