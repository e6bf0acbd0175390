// A target drawn by hand: points of time and voltage, by pointer, keys or text.

import { byId, svg } from "./dom.js";
import { ticks } from "./axis.js";

const [HEIGHT, LEFT, RIGHT, TOP, BOTTOM] = [240, 58, 14, 14, 34];
/** Smallest distance between two points, in s. */
const APART_S = 0.1;
/** Steps of the arrow keys, in s and V, and their factor with the shift key. */
const [STEP_S, STEP_V, COARSE] = [0.5, 10, 5];
/** Largest number of points that a line along the whole target has. */
const MOST_DRAWN = 80;
/** A pointer that moves less than this, in units of the drawing, adds a single point. */
const CLICK = 5;

/** The points of a target, and the drawing in which they are changed. */
export class Target {
  /** [time in s, voltage in V], by increasing time. */
  points = [[0, 0], [5, 300], [20, 100], [35, 450], [60, 450]];
  #highest = 700;
  #width = 720;
  #changed;
  #place = byId("drawing");
  #text = byId("points");

  /** `changed` is called after each change. */
  constructor(changed) {
    this.#changed = changed;
    this.#text.addEventListener("change", () => this.#read());
    this.#place.addEventListener("pointerdown", (event) => this.#press(event));
    new ResizeObserver(() => this.draw()).observe(this.#place);
    this.#show();
  }

  /** The target as the CSV that `vsj stair --input` reads. */
  csv() {
    return `time_s,voltage_v\n${this.points.map((point) => point.join(",")).join("\n")}\n`;
  }

  /** The drawing extends to this voltage, in V. */
  set highest(volts) {
    if (volts === this.#highest || !(volts > 0)) return;
    this.#highest = volts;
    this.draw();
  }

  get #length() {
    return Math.max(this.points.at(-1)[0], 1);
  }

  #x = (time) => LEFT + ((this.#width - LEFT - RIGHT) * time) / this.#length;
  #y = (volts) => HEIGHT - BOTTOM - ((HEIGHT - TOP - BOTTOM) * volts) / this.#highest;

  /** The point under a pointer, rounded as far as a hand is exact. */
  #at(event) {
    const box = this.#place.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * this.#width;
    const y = ((event.clientY - box.top) / box.height) * HEIGHT;
    const time = (this.#length * (x - LEFT)) / (this.#width - LEFT - RIGHT);
    const volts = (this.#highest * (HEIGHT - BOTTOM - y)) / (HEIGHT - TOP - BOTTOM);
    const within = (value, most) => Math.min(most, Math.max(0, value));
    return [Math.round(10 * within(time, this.#length)) / 10, Math.round(within(volts, this.#highest))];
  }

  /** A press on a point moves it; elsewhere it draws a line, or adds a point. */
  #press(event) {
    event.preventDefault();
    const length = this.#length;
    const handle = event.target.dataset?.index;
    const stroke = [];
    const began = [event.clientX, event.clientY];
    const move = (now) => {
      const [time, volts] = this.#at(now);
      if (handle !== undefined) return this.#set(Number(handle), time, volts);
      if (!stroke.length && Math.hypot(now.clientX - began[0], now.clientY - began[1]) < CLICK) return;
      stroke.push([time, volts]);
      this.#replace(stroke, length);
    };
    const end = (now) => {
      removeEventListener("pointermove", move);
      if (handle === undefined && !stroke.length) this.#add(...this.#at(now));
      if (handle !== undefined) this.#focus(Number(handle));
      this.#changed();
    };
    addEventListener("pointermove", move);
    addEventListener("pointerup", end, { once: true });
  }

  /** Puts a drawn line in place of the points of its times. */
  #replace(stroke, length) {
    const times = stroke.map(([time]) => time);
    const [first, last] = [Math.min(...times), Math.max(...times)];
    const every = Math.max(APART_S, length / MOST_DRAWN);
    const drawn = [];
    for (const point of [...stroke].sort((a, b) => a[0] - b[0])) {
      if (!drawn.length || point[0] - drawn.at(-1)[0] >= every) drawn.push(point);
    }
    const outside = this.points.filter(([time], index) => {
      const isEnd = index === 0 || index === this.points.length - 1;
      return isEnd ? drawn.every(([at]) => Math.abs(at - time) >= APART_S) : time < first - APART_S || time > last + APART_S;
    });
    this.points = [...outside, ...drawn].sort((a, b) => a[0] - b[0]);
    if (this.points[0][0] > 0) this.points.unshift([0, 0]);
    this.#show();
  }

  /** Moves a point, between its neighbours; the first one stays at 0 s. */
  #set(index, time, volts) {
    const before = this.points[index - 1]?.[0] ?? -APART_S;
    const after = this.points[index + 1]?.[0] ?? 600;
    const at = index === 0 ? 0 : Math.min(Math.max(time, before + APART_S), after - APART_S);
    this.points[index] = [Math.round(10 * at) / 10, Math.round(Math.min(this.#highest, Math.max(0, volts)))];
    this.#show();
  }

  #add(time, volts) {
    if (this.points.some(([at]) => Math.abs(at - time) < APART_S)) return;
    this.points.push([time, volts]);
    this.points.sort((a, b) => a[0] - b[0]);
    this.#show();
    this.#focus(this.points.findIndex(([at]) => at === time));
  }

  #key(event, index) {
    const [time, volts] = this.points[index];
    const factor = event.shiftKey ? COARSE : 1;
    const moves = {
      ArrowLeft: [-STEP_S * factor, 0],
      ArrowRight: [STEP_S * factor, 0],
      ArrowDown: [0, -STEP_V * factor],
      ArrowUp: [0, STEP_V * factor],
    };
    if (moves[event.key]) {
      const [later, higher] = moves[event.key];
      this.#set(index, time + later, volts + higher);
      this.#focus(index);
    } else if (event.key === "Insert" || event.key === "+") {
      const [next, level] = this.points[index + 1] ?? [time + 10, volts];
      this.#add(Math.round(5 * (time + next)) / 10, Math.round((volts + level) / 2));
    } else if (event.key === "Delete" && this.points.length > 2 && index > 0) {
      this.points.splice(index, 1);
      this.#show();
      this.#focus(Math.min(index, this.points.length - 1));
    } else {
      return;
    }
    event.preventDefault();
    this.#changed();
  }

  #focus(index) {
    this.#place.querySelector(`[data-index="${index}"]`)?.focus();
  }

  /** Takes the points of the text field: seconds and volts, one point a line. */
  #read() {
    const points = this.#text.value.split("\n").filter((line) => line.trim()).map((line) => line.trim().split(/[\s,;]+/).map(Number));
    const wrong = points.findIndex(([time, volts], index) =>
      !(time >= 0 && Number.isFinite(volts) && (index === 0 || time > points[index - 1][0])));
    const short = points.length < 2;
    const message = short ? "Two points or more are needed." : wrong < 0 ? "" : `Point ${wrong + 1}: expected a later time in s and a voltage in V.`;
    this.#text.setCustomValidity(message);
    if (!this.#text.reportValidity()) return;
    this.points = points.map(([time, volts]) => [time, volts]);
    this.#show();
    this.#changed();
  }

  /** Shows changed points, as a drawing and as text. */
  #show() {
    this.#text.value = this.points.map((point) => point.join(" ")).join("\n");
    this.draw();
  }

  /** Draws all anew; the point that has the keyboard keeps it. */
  draw() {
    // As wide as it is shown, so that text and points keep their size.
    this.#width = Math.max(280, this.#place.clientWidth);
    this.#place.setAttribute("viewBox", `0 0 ${this.#width} ${HEIGHT}`);
    const focused = this.#place.contains(document.activeElement) ? document.activeElement.dataset.index : undefined;
    const line = byId("linear").checked
      ? this.points.map(([time, volts]) => `${this.#x(time)} ${this.#y(volts)}`).join("L")
      : this.points.map(([time, volts], index) => (index ? `H${this.#x(time)}V${this.#y(volts)}` : `${this.#x(time)} ${this.#y(volts)}`)).join("");
    const across = ticks({ low: 0, high: this.#length }, this.#width < 500 ? 4 : 8);
    const upwards = ticks({ low: 0, high: this.#highest }, 5);
    const points = this.points.map(([time, volts], index) => {
      return svg("circle", {
        cx: this.#x(time), cy: this.#y(volts), r: this.points.length > 20 ? 5 : 9, "data-index": index, tabindex: 0, role: "slider",
        "aria-label": `Point ${index + 1} of ${this.points.length}`, "aria-valuemin": 0, "aria-valuemax": this.#highest,
        "aria-valuenow": volts, "aria-valuetext": `${volts} volts at ${time} seconds`, fill: "#0072b2",
        onkeydown: (event) => this.#key(event, index),
      });
    });
    this.#place.replaceChildren(
      ...across.flatMap(({ value, label }) => [
        svg("path", { d: `M${this.#x(value)} ${TOP}V${HEIGHT - BOTTOM}`, stroke: "#cccccc" }),
        svg("text", { x: this.#x(value), y: HEIGHT - 10, "text-anchor": "middle" }, `${label} s`),
      ]),
      ...upwards.flatMap(({ value, label }) => [
        svg("path", { d: `M${LEFT} ${this.#y(value)}H${this.#width - RIGHT}`, stroke: "#cccccc" }),
        svg("text", { x: LEFT - 6, y: this.#y(value) + 5, "text-anchor": "end" }, `${label} V`),
      ]),
      svg("path", { d: `M${line}`, fill: "none", stroke: "#888888", "stroke-width": 2 }),
      ...points,
    );
    if (focused !== undefined) this.#focus(focused);
  }
}
