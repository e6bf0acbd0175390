//! The equation of a record that its findings do not explain: a hypothesis, with its parameters and errors.

use std::fmt::Write;

use identify::answer::{Equation, HeldOutErrors};
use identify::dimension::Dimension;
use identify::record::scales::Scales;
use maud::{Markup, html};

use crate::output::diagnosis::number::{interval, number};

/// What the section is.
const CAPTION: &str = "The equation that predicts held-out segments best, of those that a search over lags, memories, curves and \
                       products has tried: a hypothesis, not a finding.";

/// The section for the terminal; empty without an equation.
pub(super) fn text(equation: Option<&Equation>, scales: &Scales) -> String {
    let mut text = String::new();
    let Some(equation) = equation else { return text };
    let _ = writeln!(text, "\nequation, a hypothesis, no finding\n  {}", equation.text);
    for definition in &equation.definitions {
        let _ = writeln!(text, "    {definition}");
    }
    let _ = writeln!(text, "  {}", parameters(equation, scales).join(", "));
    let _ = writeln!(text, "  {}", errors(equation, scales));
    match (&equation.plant, &equation.no_plant) {
        (Some(plant), _) => {
            let _ = writeln!(text, "  as a plant file:");
            plant.lines().for_each(|line| text += &format!("    {line}\n"));
        }
        (None, Some(reason)) => {
            let _ = writeln!(text, "  no plant file: {reason}");
        }
        (None, None) => (),
    }
    text
}

/// The section of the page; empty without an equation.
pub(super) fn section(equation: Option<&Equation>, scales: &Scales) -> Markup {
    html! {
        @if let Some(equation) = equation {
            h2 { "Equation" }
            p.small { (CAPTION) }
            pre { (equation.text) }
            ul.parameters { @for parameter in parameters(equation, scales) { li { (parameter) } } }
            ul.small { @for definition in &equation.definitions { li { (definition) } } }
            p { (errors(equation, scales)) "." }
            @if let Some(plant) = &equation.plant {
                p { "As a plant file for " code { "vsj stair --plant" } ":" }
                pre { (plant) }
            } @else if let Some(reason) = &equation.no_plant {
                p { "No plant file: " (reason) "." }
            }
        }
    }
}

/// Each parameter with its interval.
fn parameters(equation: &Equation, scales: &Scales) -> Vec<String> {
    let shown = |(name, parameter): &(String, identify::answer::Parameter)| {
        let unit = if parameter.dimension == Dimension::Ratio { parameter.unit.as_str() } else { "" };
        let bound = if parameter.at_bound { " (at its bound)" } else { "" };
        format!("{name} = {} {unit}", interval(parameter, scales)).trim_end().to_owned() + bound
    };
    equation.parameters.iter().map(shown).collect()
}

/// Errors on held-out segments in one sentence.
fn errors(equation: &Equation, scales: &Scales) -> String {
    let HeldOutErrors { nominal, extended, linear, equation: own } = equation.held_out;
    let unit = scales.unit(Dimension::ReadingSize);
    format!(
        "held-out RMSE {} {unit}; extended simulation {}, best linear model {}, simulation {}; {} nats likelier than the extended \
         simulation, {} than the linear model",
        number(own),
        number(extended),
        number(linear),
        number(nominal),
        number(equation.nats_over_extended),
        number(equation.nats_over_linear)
    )
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use identify::answer::Parameter;

    /// An equation with a play.
    pub(in crate::output::diagnosis) fn example() -> Equation {
        let parameter = |value: f64, unit: &str, dimension| Parameter {
            value,
            low: value - 1.0,
            high: value + 1.0,
            unit: unit.into(),
            at_bound: false,
            extrapolated_from_v: None,
            dimension,
        };
        Equation {
            text: "y = c0 + c1 v; v = play(u, r1, a1)".into(),
            blocks: vec!["play"],
            definitions: vec!["play(x, r, a): <a part>".into()],
            parameters: vec![
                ("c1".into(), parameter(2.0, "mm/V", Dimension::Ratio)),
                ("r1".into(), parameter(34.0, "V", Dimension::Voltage)),
            ],
            rmse: 1.0,
            held_out: HeldOutErrors { nominal: 8.0, extended: 4.0, linear: 2.0, equation: 1.0 },
            nats_over_extended: 300.0,
            nats_over_linear: 100.0,
            plant: None,
            no_plant: Some("a product".into()),
        }
    }

    #[test]
    fn equation_is_called_a_hypothesis_with_parameters_errors_and_plant() {
        let text = text(Some(&example()), &Scales::default());
        for part in [
            "a hypothesis, no finding",
            "y = c0 + c1 v; v = play(u, r1, a1)",
            "c1 = 2.0 [1.0, 3.0] mm/V, r1 = 34.0 [33.0, 35.0] V",
            "held-out RMSE 1.000 V; extended simulation 4.000, best linear model 2.000, simulation 8.000",
            "no plant file: a product",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
        let with_plant = Equation { plant: Some("schema = 1\n".into()), no_plant: None, ..example() };
        let page = section(Some(&with_plant), &Scales::default()).into_string();
        for part in ["a hypothesis, not a finding", "<pre>schema = 1\n</pre>", "&lt;a part&gt;", "300.0 nats"] {
            assert!(page.contains(part), "{part}: {page}");
        }
    }

    #[test]
    fn without_an_equation_nothing_is_shown() {
        assert_eq!(text(None, &Scales::default()), "");
        assert_eq!(section(None, &Scales::default()).into_string(), "");
    }
}
