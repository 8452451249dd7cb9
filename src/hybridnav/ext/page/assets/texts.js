// What the page says: one table for each language.

const TABLES = JSON.parse(document.getElementById("texts").textContent);
export const LANGUAGES = Object.fromEntries(Object.entries(TABLES).map(([code, table]) => [code, table["own-name"]]));
const SPOKEN = navigator.languages.map((each) => each.slice(0, 2)).find((each) => each in TABLES) ?? "en";

// What the address remembers: the face, "staff" or "robot", the language, and who goes.
export const settings = { face: "staff", language: SPOKEN, profile: "" };
const remembered = new URLSearchParams(location.hash.slice(1));
if (remembered.get("face") === "robot") settings.face = "robot";
if (remembered.get("language") in TABLES) settings.language = remembered.get("language");
settings.profile = remembered.get("profile") ?? "";

export function remember(change) {
  Object.assign(settings, change);
  const kept = Object.entries(settings).filter(([, value]) => value);
  history.replaceState(null, "", `#${new URLSearchParams(kept)}`);
}

export function t(key, ...values) {
  const words = values.map((value) => (typeof value === "number" ? value.toLocaleString(settings.language, { useGrouping: false }) : value));
  return TABLES[settings.language][key].replaceAll(/\{(\d)\}/g, (_, at) => words[at]);
}

// A profile that every building has goes by a name of the language, another one by its own.
export function profileName(name) {
  return TABLES[settings.language][`profile-${name}`] ?? name;
}

// What the server says in English, as far as the language has words for it.
export function said(text) {
  return text.split("; ").map((part) => TABLES[settings.language].server
    .reduce((now, [pattern, words]) => now.replace(new RegExp(pattern, "g"), words), part)).join("; ");
}

export function written(value, decimals = 0) {
  return value.toLocaleString(settings.language, { minimumFractionDigits: decimals, maximumFractionDigits: decimals, useGrouping: decimals === 0 });
}

// Write the texts of the language wherever the page names them.
export function translate() {
  document.documentElement.lang = settings.language;
  for (const part of document.querySelectorAll("[data-text]")) part.textContent = t(part.dataset.text);
  for (const part of document.querySelectorAll("[data-label]")) {
    const text = t(part.dataset.label);
    if (part.tagName !== "LABEL") part.ariaLabel = text;
    if (/BUTTON|LABEL/.test(part.tagName)) part.title = text;
  }
  for (const part of document.querySelectorAll("[data-empty]")) part.dataset.says = t(part.dataset.empty);
  for (const part of document.querySelectorAll("[data-placeholder]")) part.placeholder = t(part.dataset.placeholder + (settings.face === "robot" ? "-robot" : ""));
}
