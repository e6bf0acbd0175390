// The page: its two panels, and what goes from one to the other.

import { ControlPanel } from "./control.js";
import { byId } from "./dom.js";
import { RecordPanel } from "./records.js";
import { resetSpring } from "./spring.js";

const control = new ControlPanel();
/** Controls a spring, the text of a plant file. */
function controlSpring(plant) {
  byId("plant").value = plant;
  // An effect is hidden in a plain spring only.
  byId("effect").value = "";
  byId("more-spring").open = true;
  byId("control-title").scrollIntoView();
  byId("controller").focus();
  control.update();
}

/** Simulates a planned experiment, the text of a CSV file. */
function simulate(csv) {
  control.simulate(csv);
  byId("control-title").scrollIntoView();
  byId("target").focus();
}

const records = new RecordPanel(controlSpring, simulate);

byId("report-spring").addEventListener("click", () => {
  resetSpring();
  byId("more-spring").open = false;
  control.update();
});

/** The bytes of the simulated record. */
const simulated = () => new TextEncoder().encode(control.hidden.csv).buffer;

byId("diagnose-hidden").addEventListener("click", () => {
  records.take([{ name: "record.csv", bytes: simulated() }]);
  byId("between").value = "hold";
  byId("record-title").scrollIntoView();
  byId("cancel").focus();
  records.diagnose();
});

byId("add-hidden").addEventListener("click", () => {
  records.add("record.csv", simulated());
  byId("between").value = "hold";
  byId("record-title").scrollIntoView();
  byId("diagnose").focus();
});
