// Plots as SVG: lines over a common axis, in the colours of the report pages.

import { axis, ticks } from "./axis.js";
import { digits, html, svg, table } from "./dom.js";

/** Colours with a meaning, the same as in the report pages, whose style sheet has their dark counterparts. */
export const COLOUR = { target: "#888888", before: "#d55e00", after: "#0072b2", other: "#009e73", reading: "#000000" };

const [LEFT, RIGHT, TOP, BOTTOM] = [58, 14, 30, 48];
const HEIGHT = 270;
/** Number of rows in the table of a plot's values. */
const LISTED = 40;

/**
 * Shows a plot in an element, and again whenever its width changes.
 * chart: { title, x, y, series: [{ name, colour, curve: { x, y }, wide, dashed }], areas: { name, of: [[x0, x1, y0, y1]] } }
 */
export function show(place, chart) {
  const figure = html("figure");
  const shown = html("div");
  const hint = html("p", { class: "small reading-line", "aria-hidden": "true" }, "\u00a0");
  figure.append(shown, legend(chart), hint, values(chart));
  place.replaceChildren(figure);
  let width = 0;
  const draw = () => {
    const now = Math.max(280, Math.round(shown.clientWidth));
    if (now !== width) shown.replaceChildren(drawing(chart, (width = now), hint));
  };
  draw();
  new ResizeObserver(draw).observe(shown);
}

/** The names of the series with samples of their lines. */
function legend({ series, areas }) {
  const entries = series.map(({ name, ...line }) => [name, svg("line", { x1: 0, y1: 6, x2: 28, y2: 6, ...stroke(line) })]);
  if (areas?.of.length) entries.push([areas.name, svg("rect", { width: 28, height: 12, fill: COLOUR.other, "fill-opacity": 0.3 })]);
  const entry = ([name, sample]) =>
    html("li", {}, svg("svg", { class: "plot", width: 30, height: 12, "aria-hidden": "true" }, sample), ` ${name}`);
  return html("ul", { class: "legend" }, ...entries.map(entry));
}

function stroke({ colour, wide, dashed }) {
  return {
    fill: "none",
    stroke: colour,
    "stroke-linejoin": "round",
    "stroke-width": wide ? 5 : 1.8,
    "stroke-opacity": wide ? 0.35 : 1,
    "stroke-dasharray": dashed ? "7 4" : null,
  };
}

function drawing(chart, width, hint) {
  const across = axis(chart.series.flatMap(({ curve }) => [curve.x[0], curve.x.at(-1)]));
  const upwards = axis(chart.series.flatMap(({ curve }) => curve.y), 0.04);
  const x = (value) => LEFT + ((width - LEFT - RIGHT) * (value - across.low)) / (across.high - across.low);
  const y = (value) => HEIGHT - BOTTOM - ((HEIGHT - TOP - BOTTOM) * (value - upwards.low)) / (upwards.high - upwards.low);
  const drawn = svg("svg", {
    class: "plot live",
    viewBox: `0 0 ${width} ${HEIGHT}`,
    role: "img",
    "aria-label": `${chart.title}: ${chart.series.map(({ name }) => name).join(", ")}`,
  });
  for (const { value, label } of ticks(across, width < 500 ? 5 : 8)) {
    drawn.append(
      svg("path", { d: `M${x(value)} ${TOP}V${HEIGHT - BOTTOM}`, stroke: "#cccccc" }),
      svg("text", { x: x(value), y: HEIGHT - BOTTOM + 18, "text-anchor": "middle" }, label),
    );
  }
  for (const { value, label } of ticks(upwards, 6)) {
    drawn.append(
      svg("path", { d: `M${LEFT} ${y(value)}H${width - RIGHT}`, stroke: "#cccccc" }),
      svg("text", { x: LEFT - 6, y: y(value) + 5, "text-anchor": "end" }, label),
    );
  }
  drawn.append(
    svg("text", { x: 4, y: 16 }, chart.y),
    svg("text", { x: (LEFT + width - RIGHT) / 2, y: HEIGHT - 8, "text-anchor": "middle" }, chart.x),
    svg("path", { d: `M${LEFT} ${TOP}V${HEIGHT - BOTTOM}H${width - RIGHT}`, stroke: "#000000", fill: "none" }),
  );
  for (const [x0, x1, y0, y1] of chart.areas?.of ?? []) {
    const [top, bottom] = [y(Math.max(y0, y1)), y(Math.min(y0, y1))];
    const size = { width: Math.max(1, x(x1) - x(x0)), height: Math.max(1, bottom - top) };
    drawn.append(svg("rect", { x: x(x0), y: top, ...size, fill: COLOUR.other, "fill-opacity": 0.3 }));
  }
  for (const series of chart.series) {
    const points = series.curve.x.map((at, index) => `${x(at).toFixed(1)} ${y(series.curve.y[index]).toFixed(1)}`);
    drawn.append(svg("path", { d: `M${points.join("L")}`, ...stroke(series) }));
  }
  const cursor = svg("path", { stroke: "#000000", "stroke-opacity": 0.4 });
  drawn.append(cursor);
  drawn.addEventListener("pointermove", (event) => {
    const box = drawn.getBoundingClientRect();
    const part = ((event.clientX - box.left) / box.width * width - LEFT) / (width - LEFT - RIGHT);
    if (part < 0 || part > 1) return;
    const at = across.low + part * (across.high - across.low);
    cursor.setAttribute("d", `M${x(at)} ${TOP}V${HEIGHT - BOTTOM}`);
    hint.textContent = row(chart, at).map((text, index) => `${names(chart)[index]}: ${text}`).join(" · ");
  });
  return drawn;
}

const names = (chart) => [chart.x, ...chart.series.map(({ name }) => name)];

/** The position and the values of all series there. */
function row(chart, at) {
  return [digits(at), ...chart.series.map(({ curve }) => digits(valueAt(curve, at)))];
}

/** The value of a curve at a position, that of the point before it. */
export function valueAt({ x, y }, at) {
  let [low, high] = [0, x.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (x[middle] <= at) low = middle + 1;
    else high = middle;
  }
  return y[Math.max(0, low - 1)];
}

/** The values as a table, for whoever does not see the plot. */
function values(chart) {
  const details = html("details", {}, html("summary", {}, `Values: ${chart.title}`));
  details.addEventListener("toggle", () => {
    if (details.children.length > 1) return;
    const { low, high } = axis(chart.series.flatMap(({ curve }) => [curve.x[0], curve.x.at(-1)]));
    const at = Array.from({ length: LISTED + 1 }, (_, index) => low + ((high - low) * index) / LISTED);
    details.append(table(names(chart), at.map((position) => row(chart, position)), chart.title));
  });
  return details;
}
