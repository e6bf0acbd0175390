// The plan of the next experiment: from the JSON of a diagnosis, within what the user allows.

import { byId, digits, save, say, table } from "./dom.js";
import { Cancelled } from "./engine.js";
import { COLOUR, show } from "./plot.js";

/** Colours of the sets of causes, the likeliest first. */
const COLOURS = [COLOUR.after, COLOUR.before, COLOUR.other, COLOUR.reading, COLOUR.target];

/** The panel. `simulate` receives the CSV of a plan that the user wants to simulate. */
export class PlanPanel {
  #engine;
  #diagnosis;
  #plan;

  constructor(engine, simulate) {
    this.#engine = engine;
    byId("plan").addEventListener("click", () => this.#run());
    byId("save-schedule").addEventListener("click", () => save("schedule.csv", this.#plan.csv, "text/csv"));
    byId("save-plan").addEventListener("click", () => save("plan.json", `${this.#plan.json}\n`, "application/json"));
    byId("simulate-plan").addEventListener("click", () => simulate(this.#plan.csv));
  }

  /** Offers a plan after a diagnosis, the JSON; without one, none. */
  offer(diagnosis) {
    this.#diagnosis = diagnosis;
    byId("next").hidden = !diagnosis;
    byId("planned").hidden = true;
    byId("plan-error").textContent = "";
    say("plan-status", "");
  }

  async #run() {
    const number = (id) => (byId(id).value === "" ? null : Number(byId(id).value));
    const request = { minutes: number("minutes"), limit_v: number("plan-limit"), slew_v_per_s: number("plan-slew") };
    byId("plan").disabled = true;
    byId("plan-error").textContent = "";
    say("plan-status", "Planning.");
    try {
      const files = new TextEncoder().encode(this.#diagnosis).buffer;
      this.#plan = await this.#engine.ask({ command: "plan", ...request }, { files });
      this.#show();
    } catch (error) {
      byId("planned").hidden = true;
      say("plan-status", "");
      if (!(error instanceof Cancelled)) byId("plan-error").textContent = error.message;
    }
    byId("plan").disabled = false;
  }

  #show() {
    const { json, schedule, responses, unit } = this.#plan;
    const plan = JSON.parse(json);
    byId("plan-json").textContent = json;
    byId("planned").hidden = false;
    const x = "time [s]";
    show(byId("schedule-plot"), {
      title: "Schedule", x, y: "voltage [V]", series: [{ name: "commanded", colour: COLOUR.target, curve: steps(schedule) }],
    });
    const series = responses.map(([set, curve], index) => ({ name: causes(set), colour: COLOURS[index % COLOURS.length], curve }));
    show(byId("response-plot"), { title: "Predicted readings", x, y: `reading [${unit}]`, series });
    byId("plan-answer").replaceChildren(...answer(plan));
    say("plan-status", [sentence(plan), ...plan.remarks.map((remark) => `${remark}.`)].join(" "));
  }
}

/** The course of a voltage that is held until the next point. */
function steps({ x, y }) {
  const points = x.flatMap((time, index) => (index ? [[time, y[index - 1]], [time, y[index]]] : [[time, y[index]]]));
  return { x: points.map(([time]) => time), y: points.map(([, volts]) => volts) };
}

const causes = (set) => set.join(" + ") || "no cause";

function sentence({ minutes, range_v, probability, decides }) {
  const schedule = `${digits(minutes)} minutes between ${digits(range_v[0])} and ${digits(range_v[1])} V`;
  if (probability == null) return `Nothing is undecided; ${schedule} for the tightest intervals.`;
  return `${schedule} decide between ${decides.map(causes).join("; ")} with a predicted probability of ${digits(probability, 3)}.`;
}

function answer({ suspects, separations, intervals }) {
  const parts = [];
  if (suspects.length) {
    const rows = suspects.map(({ cause, nats, probability, rival }) => [
      { text: cause, class: "cause" }, `1 to ${digits(Math.exp(-nats))}`, digits(probability, 3), { text: causes(rival), class: "cause" },
    ]);
    parts.push(table(["suspect", "odds today", "confirmed if true", "hardest to reject"], rows, "What the experiment shows of the suspects"));
  }
  if (separations.length) {
    const rows = separations.map(({ truth, rival, nats, probability }) => [
      { text: causes(truth), class: "cause" }, { text: causes(rival), class: "cause" }, digits(nats), digits(probability, 3),
    ]);
    parts.push(table(["if true", "against", "nats", "probability"], rows, "What the experiment separates"));
  }
  if (intervals.length) {
    const rows = intervals.map(({ cause, parameter, value, now, planned, unit }) => [
      { text: `${cause} ${parameter}`, class: "cause" }, `${digits(value)} ${unit}`, digits(now), digits(planned),
    ]);
    parts.push(table(["quantity", "value", "now +-", "planned +-"], rows, "95 % intervals of the likeliest set"));
  }
  return parts;
}
