// The record panel: a CSV file identified or diagnosed in a worker, with progress, and what was found.

import { byId, digits, html, save, table } from "./dom.js";
import { Cancelled, Engine } from "./engine.js";
import { COLOUR, show } from "./plot.js";
import { spring } from "./spring.js";

/** Largest file, in MiB: the engine's memory is the browser's. */
const MOST_MIB = 64;

/** The panel. `control` receives a plant file's text to be controlled. */
export class RecordPanel {
  #engine = new Engine();
  #file;
  #control;
  #clock;

  constructor(control) {
    this.#control = control;
    byId("file").addEventListener("change", ({ target }) => {
      if (target.files[0]) this.#open(target.files[0]);
      // The same file may be chosen again after it has changed.
      target.value = "";
    });
    // Anywhere on the page: beside the field a browser would open the file instead.
    for (const kind of ["dragover", "dragleave", "drop"]) {
      document.addEventListener(kind, (event) => {
        event.preventDefault();
        byId("drop").classList.toggle("over", kind === "dragover");
        if (kind === "drop" && event.dataTransfer.files[0]) this.#open(event.dataTransfer.files[0]);
      });
    }
    byId("diagnose").addEventListener("click", () => this.#run("diagnose"));
    byId("identify").addEventListener("click", () => this.#run("identify"));
    byId("cancel").addEventListener("click", () => this.#engine.cancel());
    byId("save-diagnosis").addEventListener("click", () =>
      save(byId("diagnosis-json").dataset.name, `${byId("diagnosis-json").textContent}\n`, "application/json"));
    byId("save-plant").addEventListener("click", () => save("plant.toml", byId("plant-text").textContent));
    byId("use-plant").addEventListener("click", () => this.#control(byId("plant-text").textContent));
    this.#busy(false);
  }

  async #open(file) {
    if (file.size > MOST_MIB * 2 ** 20) return this.#refuse(`${file.name}: larger than ${MOST_MIB} MiB; \`vsj diagnose\` reads it`);
    this.take(file.name, await file.arrayBuffer());
  }

  /** Takes the bytes of a file as the record. */
  take(name, bytes) {
    this.#file = { name, bytes };
    byId("file-name").textContent = `${name}, ${digits(bytes.byteLength / 1024, 3)} KiB`;
    byId("record-error").textContent = "";
    this.#busy(false);
  }

  /** Diagnoses the record. */
  diagnose() {
    return this.#run("diagnose");
  }

  #request(command) {
    const text = (id) => byId(id).value.trim();
    const plant = byId("nominal").value === "panel" ? spring() : byId("nominal").value;
    return {
      command,
      name: this.#file.name,
      time: text("time-column"),
      voltage: text("voltage-column"),
      reading: text("reading-column"),
      input: byId("between").value,
      sort: byId("sort").checked,
      plant,
      effort: byId("effort").value,
    };
  }

  #busy(busy) {
    byId("diagnose").disabled = byId("identify").disabled = busy || !this.#file;
    byId("cancel").disabled = !busy;
    byId("progress").hidden = !busy;
    document.body.dataset.record = busy ? "running" : "idle";
    clearInterval(this.#clock);
    if (!busy) return;
    const began = performance.now();
    const tell = () => (byId("elapsed").textContent = `${((performance.now() - began) / 1000).toFixed(0)} s`);
    tell();
    this.#clock = setInterval(tell, 1000);
  }

  async #run(command) {
    byId("record-error").textContent = "";
    byId("found").hidden = true;
    byId("record-status").textContent = `${command === "diagnose" ? "Diagnosing" : "Identifying"} ${this.#file.name}.`;
    byId("so-far").textContent = "";
    this.#busy(true);
    const onProgress = ({ causes }) => (byId("so-far").textContent = `So far: ${causes || "no cause"}.`);
    try {
      const found = await this.#engine.ask(this.#request(command), { file: this.#file.bytes, onProgress });
      this.#show(command, found);
    } catch (error) {
      if (error instanceof Cancelled) byId("record-status").textContent = "Cancelled.";
      else this.#refuse(error.message);
    }
    this.#busy(false);
  }

  #refuse(message) {
    byId("record-error").textContent = message;
    byId("record-status").textContent = "";
  }

  #show(command, { json, remarks, plant, units, curves }) {
    const report = JSON.parse(json);
    byId("diagnosis-json").textContent = json;
    byId("diagnosis-json").dataset.name = command === "diagnose" ? "diagnosis.json" : "identify.json";
    byId("plant-text").textContent = plant;
    const parts = command === "diagnose" ? diagnosis(report) : identification(report);
    byId("answer").replaceChildren(...parts, ...remarks.map((remark) => html("p", { class: "small" }, remark)));
    byId("found").hidden = false;
    draw(Object.fromEntries(curves), units, Boolean(report.findings?.length));
    const identified = `Identified from ${report.rows} rows: held-out error ${digits(report.held_out_rmse)} ${report.unit}.`;
    byId("record-status").textContent = command === "diagnose" ? sentence(report) : identified;
  }
}

function draw(curves, [time, voltage, reading], extended) {
  const models = [
    { name: "nominal", colour: COLOUR.before, curve: curves.nominal },
    { name: "extended", colour: COLOUR.after, curve: extended ? curves.extended : undefined },
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

/** A size with its unit and 95 % interval. */
function size({ value, low, high, unit }) {
  return `${digits(value)} [${digits(low)}, ${digits(high)}]${unit ? ` ${unit}` : ""}`;
}

function sizes(parameters) {
  return Object.entries(parameters).map(([name, parameter]) => `${name} = ${size(parameter)}`).join("; ");
}

/** The verdict, and what the causes improve. */
function sentence({ verdict, findings, baseline, extended }) {
  if (!findings.length) return `Verdict: ${verdict}. No cause was found; held-out error ${digits(baseline.held_out_rmse)}.`;
  const [before, after] = [baseline, extended].map(({ held_out_rmse }) => digits(held_out_rmse));
  const causes = findings.map(({ cause }) => cause).join(", ");
  return `Verdict: ${verdict}, ${causes}. The held-out error goes from ${before} to ${after}, by ${digits(100 * extended.gain, 3)} %.`;
}

function diagnosis(report) {
  const { findings, suspects, alternatives, next_experiment, leftover } = report;
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

function identification({ nominal }) {
  const listed = Object.entries(nominal).flatMap(([name, value]) =>
    Array.isArray(value) ? value.map((of, index) => [`${name} ${index + 1}`, of]) : [[name, value]]);
  const known = listed.filter(([, value]) => value?.value != null);
  const rows = known.map(([name, value]) => [{ text: name, class: "cause" }, { text: size(value), class: "" }]);
  return [table(["quantity", "value [95 % interval]"], rows, "The spring that the record shows")];
}
