// What is drawn over the cells: arcs, doors, names, routes, closures, the scale bar.

export const ROUTE_COLOURS = {
  light: ["#c4122f", "#4837b6", "#b36b00", "#110328", "#6d6e6d"],
  dark: ["#ff6b7f", "#a99cff", "#ffc266", "#f2e8ff", "#b9bab9"],
};
const INKS = {
  light: { ink: "#1a1a1a", halo: "#ffffff", free: "#5c5c5c", rim: "#868686", unexplored: "#a6a6a6",
    loop: "#cc3311", closed: "#7b3294", door: "#1a1a1a", dot: "#8c8c8c", link: "#0b5cad" },
  dark: { ink: "#f2f4f5", halo: "#14181b", free: "#c3cad0", rim: "#8d979f", unexplored: "#6b757d",
    loop: "#ff9a80", closed: "#d79bea", door: "#f2f4f5", dot: "#7d8790", link: "#6bb0f5" },
};
const FONT = "system-ui, 'Segoe UI', 'Noto Sans', 'DejaVu Sans', sans-serif";
const LINK_FONT = `600 13px ${FONT}`;
const LABEL_SHIFTS = [0, -18, 18, -26, 26]; // pixels down from the middle of a room
const SLACK = 3; // pixels by which a name may reach into the walls of its room

export function inksOf(scene) {
  return INKS[scene.theme];
}

function traced(scene, points, isClosed = false) {
  const { context } = scene;
  points.forEach((point, at) => {
    const [x, y] = scene.toScreen(point);
    if (at) context.lineTo(x, y);
    else context.moveTo(x, y);
  });
  if (isClosed) context.closePath();
}

function stroked(scene, lines, colour, width, dash = []) {
  const { context } = scene;
  context.beginPath();
  for (const line of lines) traced(scene, line);
  Object.assign(context, { strokeStyle: colour, lineWidth: width, lineCap: "round", lineJoin: "round" });
  context.setLineDash(dash);
  context.stroke();
  context.setLineDash([]);
}

function dots(scene, points, colour, radius) {
  const { context } = scene;
  context.fillStyle = colour;
  for (const point of points) {
    const [x, y] = scene.toScreen(point);
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.fill();
  }
}

export function paintGraph(scene, graph) {
  if (!graph?.drawn) return;
  const inks = inksOf(scene);
  const radius = Math.min(4.5, Math.max(0.7, 0.09 * graph.spacing * scene.scale));
  const width = Math.min(1.6, Math.max(0.4, 0.5 * radius));
  stroked(scene, graph.unexplored_arcs, inks.unexplored, 0.6 * width);
  stroked(scene, graph.rim_arcs, inks.rim, 0.6 * width);
  stroked(scene, graph.free_arcs, inks.free, width);
  stroked(scene, graph.loops, inks.loop, width, [4, 2]);
  dots(scene, graph.unexplored_dots, inks.dot, 0.75 * radius);
  dots(scene, graph.free_dots, inks.ink, radius);
}

export function paintDoors(scene, doors) {
  const { context } = scene;
  const inks = inksOf(scene);
  const half = Math.min(5, Math.max(2, 5 * scene.scale));
  context.lineWidth = 1.5;
  for (const door of doors) {
    const [x, y] = scene.toScreen(door.at);
    context.beginPath();
    if (door.kind === "opening") context.rect(x - half, y - half, 2 * half, 2 * half);
    else context.arc(x, y, half, 0, 2 * Math.PI);
    context.fillStyle = door.passable ? inks.door : inks.halo;
    context.strokeStyle = door.passable ? inks.halo : inks.door;
    context.fill();
    context.stroke();
  }
}

const SHAPES = {
  lift: [[-1, -1], [1, -1], [1, 1], [-1, 1]],
  stairs: [[-1.1, 0.9], [1.1, 0.9], [0, -1.1]],
  ramp: [[0, -1.25], [1.25, 0], [0, 1.25], [-1.25, 0]],
};

// The outline of the mark of a link, for the legend.
export function linkOutline(kind, x, y, half) {
  return SHAPES[kind].map(([dx, dy]) => `${x + dx * half},${y + dy * half}`).join(" ");
}

// Mark where links begin: filled where the route takes one, and then with the floor it leads to.
export function paintLinks(scene, marks) {
  const { context } = scene;
  const inks = inksOf(scene);
  for (const { kind, at, texts, isTaken, fits } of marks) {
    const [x, y] = scene.toScreen(at);
    const half = 8;
    context.beginPath();
    SHAPES[kind].forEach(([dx, dy], n) => (n ? context.lineTo(x + dx * half, y + dy * half) : context.moveTo(x + dx * half, y + dy * half)));
    context.closePath();
    Object.assign(context, { fillStyle: isTaken ? inks.link : inks.halo, strokeStyle: inks.link, lineWidth: 2.5, lineJoin: "round" });
    context.setLineDash(fits ? [] : [3, 2]);
    context.fill();
    context.stroke();
    context.setLineDash([]);
    Object.assign(context, { font: LINK_FONT, textAlign: "center", textBaseline: "middle", strokeStyle: inks.halo, lineWidth: 4, fillStyle: inks.link });
    const middle = middleOfLink(scene, x, texts);
    texts.forEach((text, at) => {
      context.strokeText(text, middle, y + 19 + 15 * at);
      context.fillText(text, middle, y + 19 + 15 * at);
    });
  }
}

// The texts of a link stand below its mark, whole on the screen.
function middleOfLink(scene, x, texts) {
  scene.context.font = LINK_FONT;
  const half = Math.max(...texts.map((text) => scene.context.measureText(text).width)) / 2 + 3;
  return Math.max(half, Math.min(scene.width - half, x));
}

// The room on the screen that a mark of a link takes.
export function linkBoxes(scene, { at, texts }) {
  const [x, y] = scene.toScreen(at);
  const middle = middleOfLink(scene, x, texts);
  const halves = texts.map((text) => scene.context.measureText(text).width / 2 + 2);
  return [[x - 11, y - 11, x + 11, y + 11], ...halves.map((half, line) => [middle - half, y + 12 + 15 * line, middle + half, y + 26 + 15 * line])];
}

const laidOut = new Map(); // by font and text: fonts and measures take longer than all the rest

// A text in one line or, broken at a space or a hyphen, in two, with half its width.
function layouts(context, font, text) {
  const key = font + text;
  if (!laidOut.has(key)) {
    context.font = font;
    const breaks = [...text.matchAll(/[ -]/g)].map(({ index }) => [text.slice(0, index + 1).trim(), text.slice(index + 1)]);
    laidOut.set(key, [[text], ...breaks].map((lines) => ({ lines, half: Math.max(...lines.map((line) => context.measureText(line).width)) / 2 + 2 }))
      .sort((one, other) => one.lines.length - other.lines.length || one.half - other.half).slice(0, 2));
  }
  return laidOut.get(key);
}

// Write names where they do not hide one another, those of large rooms first: inside of their
// rooms and whole, or not at all.
export function paintNames(scene, rooms, taken, chosen) {
  const { context } = scene;
  const inks = inksOf(scene);
  const order = [...rooms].sort((a, b) => (b.name === chosen) - (a.name === chosen) || b.area_m2 - a.area_m2);
  const placed = [];
  context.textAlign = "center";
  context.textBaseline = "middle";
  for (const room of order) {
    const [x, y] = scene.toScreen(room.at);
    if (x < 0 || y < 0 || x > scene.width || y > scene.height) continue;
    const [left, bottom] = scene.toScreen([room.box[0], room.box[2]]);
    const [right, top] = scene.toScreen([room.box[1], room.box[3]]);
    const isInside = (box) => box[0] > Math.max(left - SLACK, 2) && box[2] < Math.min(right + SLACK, scene.width - 2)
      && box[1] > Math.max(top - SLACK, 2) && box[3] < Math.min(bottom + SLACK, scene.height - 2);
    const isFree = (box) => isInside(box) && !taken.some((b) => b[0] < box[2] && box[0] < b[2] && b[1] < box[3] && box[1] < b[3]);
    const weight = room.name === chosen ? 700 : 500;
    place: for (const size of [13, 11]) {
      const font = `${weight} ${size}px ${FONT}`;
      for (const { lines, half } of layouts(context, font, room.name)) {
        const high = (lines.length * (size + 2)) / 2;
        if (2 * half > right - left + 2 * SLACK) continue;
        const middle = Math.max(left + half, Math.min(right - half, x)); // in its room
        for (const down of LABEL_SHIFTS) {
          const box = [middle - half, y + down - high, middle + half, y + down + high];
          if (!isFree(box)) continue;
          taken.push(box);
          placed.push([room.name, ...box]);
          Object.assign(context, { font, strokeStyle: inks.halo, lineWidth: 3.5, lineJoin: "round", fillStyle: inks.ink });
          lines.forEach((line, at) => {
            const level = y + down - high + (at + 0.5) * (size + 2);
            context.strokeText(line, middle, level);
            context.fillText(line, middle, level);
          });
          break place;
        }
      }
    }
  }
  scene.canvas.dataset.names = JSON.stringify(placed);
}

// Write the numbers of doors beside them where there is room: the first of a list go first.
export function paintNumbers(scene, doors, taken) {
  const { context } = scene;
  const inks = inksOf(scene);
  Object.assign(context, { font: `600 11px ${FONT}`, textAlign: "center", textBaseline: "middle", strokeStyle: inks.halo, lineWidth: 3, lineJoin: "round", fillStyle: inks.link });
  for (const door of doors) {
    const [x, y] = scene.toScreen(door.at);
    if (x < 0 || y < 0 || x > scene.width || y > scene.height) continue;
    const half = 3.5 * String(door.number).length + 1;
    const spots = [[half + 9, -8], [-half - 9, -8], [half + 9, 8], [-half - 9, 8]].map(([right, down]) => [x + right, y + down]);
    const boxOf = ([left, middle]) => [left - half, middle - 6, left + half, middle + 6];
    const isFree = (box) => !taken.some((b) => b[0] < box[2] && box[0] < b[2] && b[1] < box[3] && box[1] < b[3]);
    const spot = spots.find((each) => isFree(boxOf(each)));
    if (!spot) continue;
    taken.push(boxOf(spot));
    context.strokeText(door.number, ...spot);
    context.fillText(door.number, ...spot);
  }
}

// The number of a lit door stands above its ring, below it near the upper rim.
const levelOfLit = (y) => (y > 90 ? y - 28 : y + 28);

export function litBoxes(scene, { at }) {
  const [x, y] = scene.toScreen(at);
  return [[x - 16, y - 16, x + 16, y + 16], [x - 18, levelOfLit(y) - 12, x + 18, levelOfLit(y) + 12]];
}

// A ring round what a line of the words is about, with the number of its door.
export function paintLit(scene, { at, door }) {
  const { context } = scene;
  const inks = inksOf(scene);
  const [x, y] = scene.toScreen(at);
  context.beginPath();
  context.arc(x, y, 13, 0, 2 * Math.PI);
  for (const [colour, width] of [[inks.halo, 7], [inks.link, 3.5]]) {
    Object.assign(context, { strokeStyle: colour, lineWidth: width });
    context.stroke();
  }
  if (!door) return;
  Object.assign(context, { font: `700 14px ${FONT}`, textAlign: "center", textBaseline: "middle" });
  const half = context.measureText(door).width / 2 + 6;
  const middle = levelOfLit(y);
  context.fillStyle = inks.link;
  context.beginPath();
  context.roundRect(x - half, middle - 10, 2 * half, 20, 5);
  context.fill();
  context.fillStyle = inks.halo;
  context.fillText(door, x, middle + 0.5);
}

// The lines of a route on one floor.
function linesOf(route, floor) {
  return route.parts.filter((part) => part.floor === floor && part.line.length).map((part) => part.line);
}

export function paintRoutes(scene, routes, chosen, floor) {
  const inks = inksOf(scene);
  const order = routes.map((route, at) => [route, at]).sort((a, b) => (a[1] === chosen) - (b[1] === chosen));
  for (const [route, at] of order) {
    const lines = linesOf(route, floor);
    if (!lines.length) continue;
    const width = at === chosen ? 4 : 2.75;
    stroked(scene, lines, inks.halo, width + 2.5);
    stroked(scene, lines, ROUTE_COLOURS[scene.theme][at % 5], width);
  }
}

export function paintDashed(scene, route, floor) {
  const lines = route ? linesOf(route, floor) : [];
  if (!lines.length) return;
  const inks = inksOf(scene);
  stroked(scene, lines, inks.halo, 4.5);
  stroked(scene, lines, inks.free, 2.25, [7, 6]);
}

// Letters say which end is which where colours do not.
export function paintEnd(scene, point, letter) {
  if (!point) return;
  const { context } = scene;
  const [x, y] = scene.toScreen(point);
  const inks = inksOf(scene);
  context.beginPath();
  context.arc(x, y, 10, 0, 2 * Math.PI);
  Object.assign(context, { fillStyle: letter === "A" ? inks.ink : ROUTE_COLOURS[scene.theme][0],
    strokeStyle: inks.halo, lineWidth: 2 });
  context.fill();
  context.stroke();
  Object.assign(context, { fillStyle: inks.halo, font: `700 12px ${FONT}`,
    textAlign: "center", textBaseline: "middle" });
  context.fillText(letter, x, y + 0.5);
}

// Shade closed areas, each a list of rings, and cross out doors, rooms and links.
export function paintClosed(scene, areas, crosses, draft) {
  const { context } = scene;
  const inks = inksOf(scene);
  for (const rings of areas) {
    context.beginPath();
    for (const ring of rings) traced(scene, ring, true);
    Object.assign(context, { fillStyle: `${inks.closed}66`, strokeStyle: inks.closed, lineWidth: 2, lineJoin: "round" });
    context.fill("evenodd");
    context.stroke();
  }
  for (const point of crosses) {
    const [x, y] = scene.toScreen(point);
    context.beginPath();
    for (const side of [-1, 1]) {
      context.moveTo(x - 8, y - 8 * side);
      context.lineTo(x + 8, y + 8 * side);
    }
    for (const [colour, width] of [[inks.halo, 7], [inks.closed, 4]]) {
      Object.assign(context, { strokeStyle: colour, lineWidth: width, lineCap: "round" });
      context.stroke();
    }
  }
  if (draft.length) {
    stroked(scene, [draft], inks.closed, 2, [5, 4]);
    dots(scene, draft, inks.closed, 4);
  }
}

// An arrow on each door that is passed one way.
export function paintWays(scene, ways) {
  const { context } = scene;
  const inks = inksOf(scene);
  for (const { at, ahead } of ways) {
    const [x, y] = scene.toScreen(at);
    const [toX, toY] = scene.toScreen([at[0] + ahead[0], at[1] + ahead[1]]);
    const turn = Math.atan2(toY - y, toX - x);
    const point = (along, across) => [x + along * Math.cos(turn) - across * Math.sin(turn), y + along * Math.sin(turn) + across * Math.cos(turn)];
    context.beginPath();
    context.moveTo(...point(-11, 0));
    context.lineTo(...point(11, 0));
    for (const across of [-7, 7]) {
      context.moveTo(...point(4, across));
      context.lineTo(...point(11, 0));
    }
    for (const [colour, width] of [[inks.halo, 7], [inks.closed, 3.5]]) {
      Object.assign(context, { strokeStyle: colour, lineWidth: width, lineCap: "round" });
      context.stroke();
    }
  }
}

// The middle of the map, where the space bar clicks.
export function paintMiddle(scene) {
  const { context, width, height } = scene;
  const inks = inksOf(scene);
  context.beginPath();
  for (const [x, y] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
    context.moveTo(width / 2 + 5 * x, height / 2 + 5 * y);
    context.lineTo(width / 2 + 18 * x, height / 2 + 18 * y);
  }
  for (const [colour, wide] of [[inks.halo, 7], [inks.link, 3]]) {
    Object.assign(context, { strokeStyle: colour, lineWidth: wide, lineCap: "butt" });
    context.stroke();
  }
}

export function paintOutline(scene, rings, hasCorners) {
  const { context } = scene;
  const inks = inksOf(scene);
  context.beginPath();
  for (const ring of rings) traced(scene, ring, true);
  Object.assign(context, { strokeStyle: inks.closed, lineWidth: 2.5, lineJoin: "round" });
  context.stroke();
  if (!hasCorners) return;
  context.lineWidth = 2;
  for (const corner of rings.flat()) {
    const [x, y] = scene.toScreen(corner);
    context.fillStyle = inks.halo;
    context.fillRect(x - 4, y - 4, 8, 8);
    context.strokeRect(x - 4, y - 4, 8, 8);
  }
}

// A bar of 1, 2 or 5 times a power of ten metres, between a tenth and a quarter of the width.
export function paintScaleBar(scene) {
  const { context } = scene;
  const inks = inksOf(scene);
  const perMetre = scene.scale / scene.map.resolution_m;
  const most = Math.min(320, 0.25 * scene.width) / perMetre;
  const power = 10 ** Math.floor(Math.log10(most));
  const metres = [5, 2, 1].map((n) => n * power).find((n) => n <= most) ?? power;
  const [left, bottom, length] = [16, scene.height - 20, metres * perMetre];
  const text = metres >= 1 ? `${metres} m` : `${Math.round(metres * 100 * 10) / 10} cm`;
  context.font = `600 13px ${FONT}`;
  const wide = Math.max(length, context.measureText(text).width);
  context.fillStyle = `${inks.halo}d9`;
  context.fillRect(left - 8, bottom - 26, wide + 16, 38);
  context.beginPath();
  context.moveTo(left, bottom - 6);
  context.lineTo(left, bottom);
  context.lineTo(left + length, bottom);
  context.lineTo(left + length, bottom - 6);
  Object.assign(context, { strokeStyle: inks.ink, lineWidth: 2, lineCap: "butt", lineJoin: "miter" });
  context.stroke();
  Object.assign(context, { fillStyle: inks.ink, textAlign: "left", textBaseline: "alphabetic" });
  context.fillText(text, left, bottom - 11);
  scene.canvas.dataset.scaleBar = text;
}
