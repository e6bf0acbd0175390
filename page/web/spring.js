// The spring of the control panel: the report's, two numbers, or the text of a plant file.

import { byId } from "./dom.js";

/** The report's instantaneous share and time constant, as the fields show them. */
const PAPER = { share: "0.0909", tau: "5.5" };

/** The spring as the engine takes it: `paper`, or the text of a plant file. */
export function spring() {
  const text = byId("plant").value.trim();
  if (text) return text;
  const [share, tau] = [byId("share").value, byId("tau").value];
  if (!share || !tau) throw new Error("The spring: expected a share and a time constant");
  if (share === PAPER.share && tau === PAPER.tau) return "paper";
  return `schema = 1\n\n[relaxation]\nshare = ${Number(share)}\ntau_s = ${Number(tau)}\n`;
}

/** Puts the report's spring back. */
export function resetSpring() {
  byId("plant").value = "";
  byId("share").value = PAPER.share;
  byId("tau").value = PAPER.tau;
}
