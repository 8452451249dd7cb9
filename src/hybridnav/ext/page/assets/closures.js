// What is closed: for all, until it is opened again, or on this page alone.

import { element } from "./route.js";
import { settings, t } from "./texts.js";

const NOTHING = { doors: [], rooms: [], polygons: [], one_way: [] };
const SAME = 1.5; // cells within which a door or a room is the one that was there before
const KEY = /^(?:(?:one-way:)?link:(?<links>.+)|(?:(?<floor>.+?):)?(?:door:(?<doors>\d{1,9})|room:(?<rooms>.+)|one-way:(?<ways>(?:door|line):.+)))$/;
const WAY = /^door:(?<number>\d+)=(?<room>.*)$/;

export class Closures {
  list = []; // on this page: { kind, floor, what }; kind is doors, rooms, polygons or links
  lasting = []; // for all: { kind, floor, what, key, since, by, why }
  draft = []; // corners of an area that is being drawn
  #before = []; // what takes the last changes back
  #told = "[]"; // what the server has said last
  #asked = 0; // changes
  #underWay = 0;

  constructor(page) {
    this.page = page;
    this.byId = (id) => document.getElementById(id);
  }

  get all() {
    return [...this.lasting, ...this.list];
  }

  // What is closed on a floor, by kind.
  #on(floor, list = this.all) {
    const found = structuredClone(NOTHING);
    for (const each of list) if (each.floor === floor && each.kind in found) found[each.kind].push(each.what);
    return found;
  }

  // Where doors and rooms of this floor are closed, to be crossed out.
  get marks() {
    const closed = this.#on(this.page.floors.at);
    const { rooms, doors } = this.page.map.rooms;
    return [...doors.filter((door) => closed.doors.includes(door.number)), ...rooms.filter((room) => closed.rooms.includes(room.name))].map((each) => each.at);
  }

  // Doors of this floor that are passed one way, with the direction of their arrow.
  get ways() {
    const { rooms } = this.page.map;
    const texts = [...(rooms.one_way ?? []), ...this.#on(this.page.floors.at).one_way];
    return texts.flatMap((text) => {
      const { number, room } = text.match(WAY)?.groups ?? {};
      const door = rooms.doors.find((each) => each.number === Number(number));
      const sign = door && (door.rooms[1] ?? "") === room ? 1 : -1;
      return door ? [{ at: door.at, ahead: door.ahead.map((part) => sign * part) }] : [];
    });
  }

  // What is shaded: drawn areas, and rooms whose outlines are there, each a list of rings.
  get areas() {
    const closed = this.#on(this.page.floors.at);
    return [...closed.polygons.map((ring) => [ring]), ...closed.rooms.map((name) => this.page.names.ringsOf(name))];
  }

  get links() {
    return this.all.filter((each) => each.kind === "links").map((each) => each.what);
  }

  // What a query sends, of all floors; the server knows what is closed for all.
  get asked() {
    const numbers = [...new Set(this.list.filter((each) => each.kind !== "links").map((each) => each.floor))];
    const links = this.list.filter((each) => each.kind === "links").map((each) => each.what);
    return { links, floors: numbers.map((floor) => ({ floor, ...this.#on(floor, this.list) })) };
  }

  // Close something, or open it again.
  toggle(kind, what) {
    if (kind === "doors" && this.byId("one-way").checked) return this.#turn(what);
    const floor = kind === "links" ? null : this.page.floors.at;
    const isIt = (each) => each.kind === kind && each.floor === floor && each.what === what;
    if (kind === "rooms") this.page.names.outlined();
    const closed = this.all.find(isIt);
    if (closed) return this.open(closed);
    if (kind === "polygons" || !this.byId("lasting").checked) return this.#become([...this.list, { kind, floor, what }]);
    const [why, by] = ["why", "by"].map((id) => this.byId(id).value.trim());
    this.byId("why").value = "";
    return this.#keep({ key: this.#keyOf(kind, floor, what), why, by }, true);
  }

  // Let a door be passed into one of its rooms alone, then into the other, then both ways again.
  async #turn(number) {
    const { rooms } = this.page.map.rooms.doors.find((door) => door.number === number);
    const ways = rooms.map((room) => `door:${number}=${room ?? ""}`);
    const now = this.all.find((each) => each.kind === "one_way" && each.floor === this.page.floors.at && ways.includes(each.what));
    const next = ways[ways.indexOf(now?.what) + 1];
    if (now) await this.open(now);
    return next ? this.toggle("one_way", next) : null;
  }

  open(each) {
    return each.key ? this.#keep(each, false) : this.#become(this.list.filter((other) => other !== each));
  }

  openAll() {
    return this.list.length ? this.#become([]) : null;
  }

  async undo() {
    if (!this.#before.length) return;
    await this.#before.pop()();
    await this.#changed();
  }

  #become(list) {
    const before = this.list;
    this.#before.push(() => { this.list = before; });
    this.list = list;
    return this.#changed();
  }

  #changed() {
    this.show();
    this.page.scene.draw();
    return this.page.routes.plan();
  }

  // --- what is closed for all: a journal of the server, which other pages and programs change too

  #keyOf(kind, floor, what) {
    if (kind === "links") return `link:${what}`;
    return `${this.page.floors.named(floor, (name) => `${name}:`)}${{ doors: "door", rooms: "room", one_way: "one-way" }[kind]}:${what}`;
  }

  #read({ what: key, ...facts }) {
    const { links, floor = "", doors, rooms, ways } = key.match(KEY)?.groups ?? {};
    const about = { floor: links ? null : this.page.floors.names.indexOf(floor), what: links ?? rooms ?? ways ?? Number(doors) };
    return { key, kind: links ? "links" : rooms ? "rooms" : ways ? "one_way" : "doors", ...about, ...facts };
  }

  #take({ closed }) {
    this.#told = JSON.stringify(closed);
    this.lasting = closed.map((item) => this.#read(item));
    if (this.lasting.some((each) => each.kind === "rooms")) this.page.names.outlined();
  }

  // Close something for all, or open it: of two who change one thing the last one counts.
  async #send({ key, why, by }, closed) {
    this.#asked += 1;
    this.#underWay += 1;
    try {
      this.#take(await this.page.link.post("closed", { what: key, closed, why, by }, ""));
    } finally {
      this.#underWay -= 1;
    }
  }

  async #keep(item, isClosed) {
    await this.#send(item, isClosed);
    this.#before.push(() => this.#send(item, !isClosed));
    await this.#changed();
  }

  async begin() {
    const found = await this.page.link.get("closed", "");
    this.page.profiles = found.profiles;
    this.#take(found);
    this.byId("lasting-part").hidden = !found.can_close;
    this.byId("lasting").checked = found.can_close && settings.face === "staff";
    this.show();
  }

  // Take over what others have changed since, and say it.
  async look() {
    const asked = this.#asked;
    const found = await this.page.link.get("closed", "");
    if (this.#underWay || asked !== this.#asked) return; // an own change came meanwhile
    if (found.versions[this.page.floors.at] !== this.page.map.rooms.version) await this.page.names.follow();
    if (JSON.stringify(found.closed) === this.#told) return;
    const before = this.lasting;
    this.#take(found);
    const without = (some, others) => some.filter((each) => !others.some((other) => other.key === each.key));
    const news = [...without(this.lasting, before).map((each) => t("other-closed", [this.#textOf(each), each.by].filter(Boolean).join(", "))),
      ...without(before, this.lasting).map((each) => t("other-opened", this.#textOf(each)))];
    await this.#changed();
    const { refusal } = this.page.routes;
    if (news.length) this.page.say([...news, refusal].filter(Boolean).join(". "), Boolean(refusal));
  }

  // Follow doors and rooms of a floor to their new numbers and names, by where they are, and
  // return what is there no more, as it was called. What is closed for all follows an own change.
  async follow(floor, before, after, isOwn) {
    const key = { doors: "number", rooms: "name" };
    const lost = [];
    const isHere = (each) => each.floor === floor && (each.kind in key || WAY.test(each.what));
    const turned = (each) => {
      const { number, room } = each.what.match(WAY).groups;
      const side = before.doors.find((door) => door.number === Number(number))?.rooms.indexOf(room || null);
      const [door] = followed({ kind: "doors", what: Number(number) });
      const now = door && after.doors.find((one) => one.number === door.what).rooms;
      const into = now?.includes(room || null) ? room : now?.[side];
      return now ? [{ ...each, what: `door:${door.what}=${into ?? ""}` }] : [];
    };
    const followed = (each) => {
      if (each.kind === "one_way") return turned(each);
      const [name, all] = [key[each.kind], after[each.kind]];
      const old = before[each.kind].find((one) => one[name] === each.what);
      const same = each.kind === "rooms" && all.find((one) => one.name === each.what);
      const found = same || (old && all.find((one) => one.area_m2 === old.area_m2 && Math.hypot(one.at[0] - old.at[0], one.at[1] - old.at[1]) < SAME));
      if (!found) lost.push(each.kind === "doors" ? t("door-n", each.what) : each.what);
      return found ? [{ ...each, what: found[name] }] : [];
    };
    this.list = this.list.flatMap((each) => (isHere(each) ? followed(each) : [each]));
    for (const each of isOwn ? this.lasting.filter(isHere) : []) {
      const [now] = followed(each);
      if (now?.what === each.what) continue;
      await this.#send(each, false);
      if (now) await this.#send({ ...each, key: this.#keyOf(each.kind, floor, now.what) }, true);
    }
    this.#before = [];
    this.show();
    return lost;
  }

  // --- areas

  addCorner(point) {
    this.draft.push(point);
    this.byId("area-done").hidden = this.draft.length < 3;
    this.page.scene.draw();
  }

  endArea(isKept) {
    const corners = this.draft;
    this.draft = [];
    this.byId("area-done").hidden = true;
    if (this.byId("area-start").ariaPressed === "true") document.querySelector("input[value=close]").checked = true;
    this.byId("area-start").ariaPressed = "false";
    this.page.scene.draw();
    return isKept && corners.length >= 3 ? this.toggle("polygons", corners) : null;
  }

  // --- the panel

  #textOf(each) {
    const areas = this.list.filter(({ kind }) => kind === "polygons");
    const what = { doors: () => t("door-n", each.what), polygons: () => t("area-n", areas.indexOf(each) + 1), one_way: () => this.#wayText(each.what) }[each.kind]?.() ?? each.what;
    return (each.floor !== null && this.page.floors.named(each.floor, (name) => t("in-floor", what, name))) || what;
  }

  #wayText(what) {
    const { number, room } = what.match(WAY)?.groups ?? {};
    return number ? t("only-into", t("door-n", number), room || t("no-room")) : what;
  }

  // Who closed something for all, when and why; a journal may also be written by hand.
  #factsOf({ key, since, by, why }) {
    if (!key) return this.byId("lasting-part").hidden ? "" : t("only-here");
    const at = new Date(`${since.replace(" ", "T")}Z`);
    const when = Number.isNaN(at.getTime()) ? since : at.toLocaleString(settings.language, { dateStyle: "medium", timeStyle: "short" });
    return [when && t("since", when), by, why].filter(Boolean).join(" · ");
  }

  show() {
    const items = this.all.map((each) => {
      const text = this.#textOf(each);
      const button = element("button", { onclick: this.page.reported(() => this.open(each)), ariaLabel: t("open-it", text) }, t("open"));
      return element("li", {}, element("span", {}, text, element("small", {}, this.#factsOf(each))), button);
    });
    this.byId("closed").replaceChildren(...items);
    this.byId("closed-count").textContent = items.length ? ` (${items.length})` : "";
    this.byId("close-undo").disabled = !this.#before.length;
    this.byId("close-clear").hidden = !this.list.length;
  }
}
