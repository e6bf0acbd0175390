"""Answers as a notebook and the prompt show them: a line of text, and a table in HTML."""

from html import escape

from . import _vsj


def diagnosis_line(it):
    """The verdict, and each cause with its probability."""
    causes = ", ".join(f"{finding.cause} ({finding.probability:.3f})" for finding in it.findings)
    return f"<vsj.Diagnosis {it.verdict}{': ' * bool(causes)}{causes}; {it.rows} rows>"


def diagnosis_html(it):
    """The verdict, and a table of the causes: probability, and size with 95 % interval."""
    before, after = (_vsj.number(quality.held_out_rmse) for quality in (it.baseline, it.extended))
    said = [f"<b>{escape(it.verdict)}</b>"]
    found = [("", finding) for finding in it.findings]
    found += [(f" in {record.name} only", finding) for record in it.records for finding in record.findings]
    said.append(f"Held-out error {before} without the causes, {after} with them." if it.findings else f"Held-out error {before}.")
    if not it.complete:
        said.append("The search was stopped: this is the best answer so far.")
    if it.suspects:
        said.append(escape(f"Suspects, no findings: {', '.join(suspect.cause for suspect in it.suspects)}."))
    if it.alternatives:
        sets = "; ".join(" with ".join(causes) or "no error at all" for causes in it.alternatives)
        said.append(escape(f"Alternatives: {sets}."))
    if it.leftover:
        said.append(escape(f"{it.leftover}."))
    if it.next_experiment:
        said.append(escape(f"To decide, {it.next_experiment}."))
    rows = "".join(
        f"<tr><td>{escape(finding.cause + where)}</td><td>{finding.probability:.3f}</td><td>{_sizes(finding)}</td></tr>"
        for where, finding in found
    )
    head = "<tr><th>cause</th><th>probability</th><th>size with 95 % interval</th></tr>"
    return f"<p>{'<br>'.join(said)}</p>" + (f"<table><thead>{head}</thead><tbody>{rows}</tbody></table>" if found else "")


def identified_line(it):
    """Gain and time constants."""
    times = ", ".join(quantity(tau) for tau in it.nominal.tau_s) or "none"
    return f"<vsj.Identified gain {quantity(it.nominal.gain)}, time constants {times}; {it.rows} rows>"


def plan_line(it):
    """Length, and what the experiment decides between."""
    decides = " or ".join(" with ".join(causes) or "no error at all" for causes in it.decides)
    return f"<vsj.Plan {it.minutes:.4g} minutes{': ' * bool(decides)}{decides}>"


def quantity(it):
    """A value with its 95 % interval and unit, as the command prints it."""
    return " ".join(filter(None, (*_vsj.with_interval(it.value, it.low, it.high), it.unit)))


def _sizes(finding):
    return "<br>".join(escape(f"{name} = {quantity(it)}") for name, it in finding.parameters.items())
