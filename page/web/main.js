// The page: its two panels, and what goes from one to the other.

import { ControlPanel } from "./control.js";
import { byId } from "./dom.js";
import { RecordPanel } from "./records.js";
import { resetSpring } from "./spring.js";

const control = new ControlPanel();
const records = new RecordPanel((plant) => {
  byId("plant").value = plant;
  // An effect is hidden in a plain spring only.
  byId("effect").value = "";
  byId("more-spring").open = true;
  byId("control-title").scrollIntoView();
  byId("controller").focus();
  control.update();
});

byId("report-spring").addEventListener("click", () => {
  resetSpring();
  byId("more-spring").open = false;
  control.update();
});

byId("diagnose-hidden").addEventListener("click", () => {
  records.take("record.csv", new TextEncoder().encode(control.hidden.csv).buffer);
  byId("between").value = "hold";
  byId("record-title").scrollIntoView();
  byId("cancel").focus();
  records.diagnose();
});
