// The record panel: CSV files identified or diagnosed in a worker, with progress, and what was found.

import { byId, digits, html, save, say, table } from "./dom.js";
import { Cancelled, Engine } from "./engine.js";
import { PlanPanel } from "./plan.js";
import { COLOUR, show } from "./plot.js";
import { spring } from "./spring.js";

/** Largest size of all files, in MiB: the engine's memory is the browser's. */
const MOST_MIB = 64;

/** The panel. `control` receives a plant file's text to be controlled, `simulate` the CSV of an experiment to be simulated. */
export class RecordPanel {
  #engine = new Engine();
  /** [{ name, bytes }], records of one spring. */
  #files = [];
  #control;
  #plan;
  #clock;
  /** The command that is computed, and whether its best answer so far was asked for. */
  #command;
  #stopping = false;
  #drawn = [];
  #units = [];

  constructor(control, simulate) {
    this.#control = control;
    this.#plan = new PlanPanel(this.#engine, simulate);
    byId("file").addEventListener("change", ({ target }) => {
      if (target.files.length) this.#open([...target.files]);
      // The same files may be chosen again after they have changed.
      target.value = "";
    });
    // Anywhere on the page: beside the field a browser would open the file instead.
    for (const kind of ["dragover", "dragleave", "drop"]) {
      document.addEventListener(kind, (event) => {
        event.preventDefault();
        byId("drop").classList.toggle("over", kind === "dragover");
        if (kind === "drop" && event.dataTransfer.files.length) this.#open([...event.dataTransfer.files]);
      });
    }
    byId("diagnose").addEventListener("click", () => this.#run("diagnose"));
    byId("identify").addEventListener("click", () => this.#run("identify"));
    byId("cancel").addEventListener("click", () => this.#cancel());
    byId("shown-record").addEventListener("change", () => this.#draw());
    byId("save-diagnosis").addEventListener("click", () =>
      save(byId("diagnosis-json").dataset.name, `${byId("diagnosis-json").textContent}\n`, "application/json"));
    byId("save-plant").addEventListener("click", () => save("plant.toml", byId("plant-text").textContent));
    byId("use-plant").addEventListener("click", () => this.#control(byId("plant-text").textContent));
    this.#busy(false);
  }

  async #open(files) {
    const size = files.reduce((sum, file) => sum + file.size, 0);
    const names = files.map(({ name }) => name).join(", ");
    if (size > MOST_MIB * 2 ** 20) return this.#refuse(`${names}: larger than ${MOST_MIB} MiB; \`vsj diagnose\` reads more`);
    this.take(await Promise.all(files.map(async (file) => ({ name: file.name, bytes: await file.arrayBuffer() }))));
  }

  /** Takes the bytes of files as the records: [{ name, bytes }]. */
  take(files) {
    this.#files = files;
    const listed = files.map(({ name, bytes }) => `${name}, ${digits(bytes.byteLength / 1024, 3)} KiB`);
    byId("file-name").textContent = listed.join("; ");
    byId("record-error").textContent = "";
    this.#busy(false);
  }

  /** Adds a record of the same spring; `name` is made different from the names that are there. */
  add(name, bytes) {
    const names = this.#files.map((file) => file.name);
    let free = name;
    for (let count = 2; names.includes(free); count += 1) free = name.replace(".", `-${count}.`);
    this.take([...this.#files, { name: free, bytes }]);
  }

  /** Diagnoses the records. */
  diagnose() {
    return this.#run("diagnose");
  }

  /** Asks for the best answer so far; if it was asked for, or if there is none, ends the work. */
  #cancel() {
    const again = this.#stopping;
    this.#stopping = true;
    if (again || this.#command !== "diagnose" || !this.#engine.stop()) return this.#engine.cancel();
    say("record-status", "Ending the search with its best answer so far. Cancel ends it without an answer.");
  }

  #request(command) {
    const text = (id) => byId(id).value.trim();
    const plant = byId("nominal").value === "panel" ? spring() : byId("nominal").value;
    return {
      command,
      files: this.#files.map(({ name, bytes }) => ({ name, length: bytes.byteLength })),
      time: text("time-column"),
      voltage: text("voltage-column"),
      reading: text("reading-column"),
      input: byId("between").value,
      sort: byId("sort").checked,
      plant,
      effort: byId("effort").value,
      order: Number(byId("order").value) || null,
    };
  }

  #busy(busy) {
    byId("diagnose").disabled = byId("identify").disabled = busy || !this.#files.length;
    byId("cancel").disabled = !busy;
    byId("progress").hidden = !busy;
    document.body.dataset.record = busy ? "running" : "idle";
    clearInterval(this.#clock);
    if (!busy) return;
    const began = performance.now();
    const tell = () => say("elapsed", `${((performance.now() - began) / 1000).toFixed(0)} s`);
    tell();
    this.#clock = setInterval(tell, 1000);
  }

  async #run(command) {
    const names = this.#files.map(({ name }) => name).join(", ");
    [this.#command, this.#stopping] = [command, false];
    byId("record-error").textContent = "";
    byId("found").hidden = true;
    say("record-status", `${command === "diagnose" ? "Diagnosing" : "Identifying"} ${names}.`);
    say("so-far", "");
    this.#busy(true);
    const onProgress = ({ causes }) => say("so-far", `So far: ${causes || "no cause"}.`);
    try {
      const files = await new Blob(this.#files.map(({ bytes }) => bytes)).arrayBuffer();
      // Nothing is searched yet that could be ended.
      if (this.#stopping) throw new Cancelled("cancelled");
      const found = await this.#engine.ask(this.#request(command), { files, onProgress });
      this.#show(command, found);
    } catch (error) {
      if (error instanceof Cancelled) say("record-status", `Cancelled. ${byId("so-far").textContent}`.trim());
      else this.#refuse(error.message);
    }
    this.#busy(false);
  }

  #refuse(message) {
    byId("record-error").textContent = message;
    say("record-status", "");
  }

  #show(command, { json, remarks, plant, units, records }) {
    const report = JSON.parse(json);
    byId("diagnosis-json").textContent = json;
    byId("diagnosis-json").dataset.name = command === "diagnose" ? "diagnosis.json" : "identify.json";
    byId("plant-text").textContent = plant;
    const parts = command === "diagnose" ? diagnosis(report) : identification(report);
    byId("answer").replaceChildren(...parts, ...remarks.map((remark) => html("p", { class: "small" }, remark)));
    byId("found").hidden = false;
    byId("shown-record").replaceChildren(...records.map(({ name }, index) => html("option", { value: index }, name)));
    byId("which-record").hidden = records.length < 2;
    // Without a cause the extended model is the nominal one.
    const extended = report.findings?.length || command === "identify";
    this.#drawn = records.map(({ curves }) => Object.fromEntries(curves.filter(([name]) => extended || name !== "extended")));
    this.#units = units;
    this.#draw();
    this.#plan.offer(command === "diagnose" ? json : undefined);
    const identified = `Identified from ${report.rows} rows: held-out error ${digits(report.held_out_rmse)} ${report.unit}.`;
    say("record-status", command === "diagnose" ? sentence(report) : identified);
  }
  /** Draws the record that is chosen. */
  #draw() {
    const curves = this.#drawn[byId("shown-record").value];
    const [time, voltage, reading] = this.#units;
    const models = [
      { name: "nominal", colour: COLOUR.before, curve: curves.nominal },
      { name: "extended", colour: COLOUR.after, curve: curves.extended },
      { name: "model", colour: COLOUR.after, curve: curves.model },
    ].filter(({ curve }) => curve);
    const x = `time [${time}]`;
    show(byId("record-plot"), {
      title: "Readings and models", x, y: `reading [${reading}]`,
      series: [{ name: "reading", colour: COLOUR.reading, curve: curves.reading, wide: true }, ...models],
    });
    show(byId("command-plot"), {
      title: "Commanded voltage", x, y: `voltage [${voltage}]`,
      series: [{ name: "commanded", colour: COLOUR.target, curve: curves.voltage }],
    });
  }
}

/** A size with its unit and 95 % interval. */
function size({ value, low, high, unit }) {
  return `${digits(value)} [${digits(low)}, ${digits(high)}]${unit ? ` ${unit}` : ""}`;
}

function sizes(parameters) {
  return Object.entries(parameters).map(([name, parameter]) => `${name} = ${size(parameter)}`).join("; ");
}

/** The verdict, and what the causes improve. */
function sentence({ verdict, findings, baseline, extended, complete }) {
  if (!complete) return `Ended early: the best answer so far. ${sentence({ verdict, findings, baseline, extended, complete: true })}`;
  if (!findings.length) return `Verdict: ${verdict}. No cause was found; held-out error ${digits(baseline.held_out_rmse)}.`;
  const [before, after] = [baseline, extended].map(({ held_out_rmse }) => digits(held_out_rmse));
  const causes = findings.map(({ cause }) => cause).join(", ");
  return `Verdict: ${verdict}, ${causes}. The held-out error goes from ${before} to ${after}, by ${digits(100 * extended.gain, 3)} %.`;
}

function diagnosis(report) {
  const { findings, suspects, alternatives, records = [], next_experiment, leftover } = report;
  const parts = [];
  if (findings.length) {
    const names = ["cause", "probability", "size [95 % interval]", "error before", "after"];
    parts.push(table(names, findings.map(causeRow), "Causes, by the error that they explain"));
    parts.push(...findings.map(({ cause, evidence }) => html("p", { class: "small" }, `${cause}: ${evidence}.`)));
  }
  if (suspects.length) {
    const rows = suspects.map(({ cause, parameters, rmse_before, rmse_after }) => [
      { text: cause, class: "cause" }, { text: sizes(parameters), class: "" }, digits(rmse_before), digits(rmse_after),
    ]);
    parts.push(table(["suspect", "size [95 % interval]", "error before", "after"], rows, "Suspects: they explain a part, without being shown"));
  }
  if (records.length) {
    const names = ["record", "rows", "zero offset", "noise", "error", "in this record only"];
    parts.push(table(names, records.map(recordRow), "Each record has its own zero, start and noise"));
  }
  if (alternatives.length) parts.push(html("p", {}, `As likely: ${alternatives.map((set) => set.join(" and ")).join("; ")}.`));
  if (leftover) parts.push(html("p", {}, `${leftover}.`));
  if (next_experiment) parts.push(html("p", {}, `Next experiment: ${next_experiment}.`));
  return parts;
}

function causeRow({ cause, probability, parameters, rmse_before, rmse_after }) {
  return [
    { text: cause, class: "cause" }, digits(probability, 3), { text: sizes(parameters), class: "" }, digits(rmse_before), digits(rmse_after),
  ];
}

function recordRow({ name, rows, offset, sigma, rmse, findings, leftover }) {
  const faults = findings.map(({ cause, parameters }) => `${cause} (${sizes(parameters)})`);
  if (leftover) faults.push(`unexplained: ${leftover}`);
  const only = { text: faults.join("; ") || "none", class: "" };
  return [{ text: name, class: "cause" }, String(rows), digits(offset), digits(sigma), digits(rmse), only];
}

function identification({ nominal }) {
  const listed = Object.entries(nominal).flatMap(([name, value]) =>
    Array.isArray(value) ? value.map((of, index) => [`${name} ${index + 1}`, of]) : [[name, value]]);
  const known = listed.filter(([, value]) => value?.value != null);
  const rows = known.map(([name, value]) => [{ text: name, class: "cause" }, { text: size(value), class: "" }]);
  return [table(["quantity", "value [95 % interval]"], rows, "The spring that the record shows")];
}
