// The control panel: a target through the controller, with stiffness, voltage and the bound.

import { byId, decimals, digits, html, save, say, table } from "./dom.js";
import { Engine } from "./engine.js";
import { COLOUR, show } from "./plot.js";
import { spring } from "./spring.js";
import { Target } from "./target.js";

/** Time after the last change of a setting before it is computed, in ms. */
const PAUSE_MS = 120;

/** The panel, which computes its settings after each change. */
export class ControlPanel {
  #engine = new Engine();
  #target = new Target(() => this.#later());
  #timer;
  #running = false;
  #again = false;
  #hidden;
  #planned;

  constructor() {
    const form = byId("control");
    form.addEventListener("submit", (event) => event.preventDefault());
    form.addEventListener("input", () => this.#later());
    byId("save-target").addEventListener("click", () => save("target.csv", this.#target.csv(), "text/csv"));
    byId("save-stair").addEventListener("click", () => save("stair.json", byId("stair-json").textContent, "application/json"));
    byId("save-record").addEventListener("click", () => save("record.csv", this.#hidden.csv, "text/csv"));
    this.#list();
    this.update();
  }

  /** Lists the effects. An engine that does not start is reported by the first run. */
  async #list() {
    const effects = await this.#engine.ask({ command: "effects" }).catch(() => []);
    byId("effect").append(...effects.map((name) => html("option", {}, name)));
  }

  /** The record with the hidden effect: `{ csv, truth }`; undefined without one. */
  get hidden() {
    return this.#hidden;
  }

  /** Simulates an experiment, the CSV of a plan, whose voltages are commanded as they are. */
  simulate(csv) {
    this.#planned = csv;
    const planned = byId("target").querySelector("[value=planned]");
    planned.hidden = planned.disabled = false;
    byId("target").value = "planned";
    byId("controller").value = "none";
    return this.update();
  }

  /** The request that the settings make. */
  request() {
    const target = byId("target").value;
    const percents = () => ({
      tau: number("known-tau"),
      share: number("known-share"),
      gain: number("known-gain"),
      overshoot: number("overshoot"),
      fall_back: number("fall-back"),
    });
    const files = { drawn: this.#target.csv(), planned: this.#planned };
    return {
      plant: spring(),
      target: files[target] ?? target,
      linear: target === "drawn" && byId("linear").checked,
      controller: byId("controller").value,
      limit_v: number("limit"),
      slew_v_per_s: byId("slew").value === "" ? null : number("slew"),
      kp: number("kp"),
      ki: number("ki"),
      approach_s: number("approach"),
      known: byId("controller").value === "robust" ? percents() : null,
      rate_hz: number("rate"),
    };
  }

  #later() {
    document.body.dataset.control = "running";
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => {
      this.#timer = undefined;
      this.update();
    }, PAUSE_MS);
    this.#fields();
  }

  /** Shows the fields that the settings need. */
  #fields() {
    const [target, controller] = [byId("target").value, byId("controller").value];
    byId("hand").hidden = target !== "drawn";
    byId("gains").hidden = controller !== "paper";
    byId("braking").hidden = controller !== "fast";
    byId("known").hidden = controller !== "robust";
    byId("record-settings").hidden = byId("effect").value === "";
    this.#target.highest = Number(byId("limit").value);
    this.#target.draw();
  }

  /** Computes the settings; while that runs, further changes wait for its end. */
  async update() {
    document.body.dataset.control = "running";
    this.#fields();
    if (this.#running) {
      this.#again = true;
      return;
    }
    this.#running = true;
    let state = "done";
    try {
      const request = this.request();
      const run = await this.#engine.ask({ command: "control", ...request });
      this.#hidden = await this.#hide(request);
      this.#show(run, request);
    } catch (error) {
      state = "refused";
      this.#refuse(error);
    } finally {
      this.#running = false;
    }
    if (this.#again) {
      this.#again = false;
      this.update();
    } else if (this.#timer === undefined) {
      document.body.dataset.control = state;
    }
  }

  async #hide(control) {
    const effect = byId("effect").value;
    if (!effect) return undefined;
    const whole = (id) => Math.trunc(number(id));
    const made = { effect, size: number("size"), noise_percent: number("noise"), seed: whole("seed"), rows: whole("rows") };
    return this.#engine.ask({ command: "hide", control, ...made });
  }

  #refuse(error) {
    byId("control-error").textContent = error.message;
    say("control-status", "");
  }

  #show(run, request) {
    byId("control-error").textContent = "";
    const answer = JSON.parse(run.json);
    byId("stair-json").textContent = run.json;
    // Without a controller the answer has the report's for comparison; its voltage is not the one that is shown.
    const controlled = request.controller === "none" ? "with the report's controller" : "with controller";
    const series = [
      { name: "target", colour: COLOUR.target, curve: run.target, dashed: true },
      { name: "without controller", colour: COLOUR.before, curve: run.without },
      { name: controlled, colour: COLOUR.after, curve: run.with },
    ];
    const hidden = this.#hidden;
    if (hidden) series.push({ name: "true, with the effect", colour: COLOUR.reading, curve: hidden.stiffness });
    const x = "time [s]";
    show(byId("stiffness"), {
      title: "Stiffness", y: "stiffness [V]", x, series,
      areas: { name: "out of reach of any controller", of: bounds(answer.steps, run.changes) },
    });
    const [low, high] = run.range_v;
    const ends = (value) => ({ x: [run.target.x[0], run.target.x.at(-1)], y: [value, value] });
    show(byId("voltage"), {
      title: "Voltage", y: "voltage [V]", x,
      series: [
        { name: "target", colour: COLOUR.target, curve: run.target, dashed: true },
        { name: "across the spring", colour: COLOUR.after, curve: run.applied },
        { name: `limits, ${low} and ${high} V`, colour: COLOUR.before, curve: ends(high), dashed: true },
      ],
    });
    byId("steps").replaceChildren(...(answer.steps.length ? [steps(answer)] : []));
    say("control-status", summary(answer, run.remarks));
    say("truth", hidden ? truth(hidden) : "");
    byId("hidden-record").hidden = !hidden;
    byId("command").textContent = command(request);
  }
}

/** The number in a field. */
function number(id) {
  const field = byId(id);
  if (field.value === "") throw new Error(`${field.labels[0].textContent}: expected a number`);
  return Number(field.value);
}

/** The areas before the bounds: until then no controller completes 97 % of a change. */
function bounds(steps, changes) {
  return steps.flatMap(({ from_v, to_v, bound_t97_s }, index) =>
    bound_t97_s == null ? [] : [[changes[index][0], changes[index][0] + bound_t97_s, from_v, from_v + 0.97 * (to_v - from_v)]]);
}

function steps({ steps, bound_from }) {
  const names = ["step [V]", "50 % [s]", "90 % [s]", "97 % [s]", "bound [s]", "overshoot [%]", "peak [V]"];
  const rows = steps.map((step) => [
    { text: `${digits(step.from_v)} to ${digits(step.to_v)}`, class: "cause" },
    ...[step.t50_s, step.t90_s, step.t97_s, step.bound_t97_s].map((value) => decimals(value, 3)),
    decimals(step.overshoot_percent, 2),
    decimals(step.peak_v, 1),
  ]);
  const start = bound_from === "settled" ? "has settled" : "is as this loop has left it";
  return table(names, rows, `Time to complete each change. The bound is that of 97 % for any controller, from a spring that ${start}.`);
}

function summary({ steps, max_fixed_point_error, limited_ticks }, remarks) {
  const times = steps.map(({ t97_s }) => t97_s);
  const slowest = times.some((time) => time == null) ? "not all changes reach 97 %" : `97 % of each change within ${digits(Math.max(...times), 3)} s`;
  const changes = steps.length ? slowest : "No change between two plateaus of at least 1 s";
  const limited = limited_ticks.upper + limited_ticks.lower + limited_ticks.slew;
  const sentences = [changes, `fixed point within ${digits(max_fixed_point_error, 3)} V of the reference`, `limits acted in ${limited} ticks`];
  return [`${sentences.join("; ")}.`, ...remarks].join(" ");
}

function truth({ truth }) {
  const values = ({ parameters }) => parameters.map(([name, value]) => `${name} = ${digits(value)}`).join(", ");
  return truth.length ? `Hidden: ${truth.map((of) => `${of.cause}, ${values(of)}`).join("; ")}.` : "Hidden: nothing but noise.";
}

/** The command that gives the same answer. */
function command(request) {
  const words = ["vsj", "stair", "--controller", request.controller];
  const file = byId("target").value === "planned" ? "schedule.csv" : "target.csv";
  words.push("--input", request.target.includes("\n") ? file : request.target);
  if (request.linear) words.push("--between", "linear");
  if (request.plant !== "paper") words.push("--plant", "plant.toml");
  words.push("--limit-v", request.limit_v);
  if (request.slew_v_per_s != null) words.push("--slew-v-per-s", request.slew_v_per_s);
  if (["none", "paper"].includes(request.controller)) words.push("--kp", request.kp, "--ki", request.ki);
  if (request.controller === "fast" && request.approach_s) words.push("--approach-s", request.approach_s);
  if (request.known) {
    for (const key of ["tau", "share", "gain"]) words.push("--known", `${key}=${request.known[key]}`);
    words.push("--overshoot-percent", request.known.overshoot);
    if (request.known.fall_back) words.push("--fall-back-percent", request.known.fall_back);
  }
  if (request.rate_hz !== 1000) words.push("--rate-hz", request.rate_hz);
  return [...words, "--json"].join(" ");
}
