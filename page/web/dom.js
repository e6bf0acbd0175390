// Elements of the page.

/** The element with an id. */
export const byId = (id) => document.getElementById(id);

/** A new HTML element with attributes and children, which are elements or texts. */
export function html(name, attributes = {}, ...children) {
  return filled(document.createElement(name), attributes, children);
}

/** A new SVG element. */
export function svg(name, attributes = {}, ...children) {
  return filled(document.createElementNS("http://www.w3.org/2000/svg", name), attributes, children);
}

/** A number, or its interval, before the unit after it. */
const VALUE = /(?<=[\d\]]) (?=(?:%|[num\u00b5kM]?[VsmNA]|k?Hz|[kMG]?Pa|degC|nats|min|h)(?!\w))/g;

/** The text with a no-break space between each number and its unit. */
const unbroken = (text) => text.replace(VALUE, "\u00a0");

/** Shows a sentence in the element with an id. */
export const say = (id, sentence) => byId(id).replaceChildren(unbroken(sentence));

function filled(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value !== false && value != null) element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.filter((child) => child != null).map((child) => (typeof child === "string" ? unbroken(child) : child)));
  return element;
}

/** Offers a text as a file to be saved. */
export function save(name, text, type = "text/plain") {
  const url = URL.createObjectURL(new Blob([text], { type }));
  const link = html("a", { href: url, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

/** A table with its head; it folds on a narrow screen. A cell is a number as a text, or { text, class }. */
export function table(names, rows, caption) {
  const parts = (value) => (typeof value === "object" ? value : { text: value, class: "number" });
  const cell = (value, index) => html("td", { class: parts(value).class, "data-name": names[index] }, parts(value).text);
  const head = (name, index) => html("th", { scope: "col", class: rows[0] && parts(rows[0][index]).class === "number" ? "number" : null }, name);
  return html(
    "table",
    {},
    html("caption", { class: "small" }, caption),
    html("thead", {}, html("tr", {}, ...names.map(head))),
    html("tbody", {}, ...rows.map((row) => html("tr", {}, ...row.map(cell)))),
  );
}

/** A number with some decimals; a dash for none. */
export const decimals = (value, count) => (value == null ? "-" : value.toFixed(count));

/** A number with some significant digits. */
export function digits(value, count = 4) {
  if (value == null || !Number.isFinite(value)) return "-";
  if (value === 0) return "0";
  const size = Math.abs(value);
  return size >= 1e6 || size < 1e-3 ? value.toExponential(count - 1) : String(Number(value.toPrecision(count)));
}
