//! The plots of a diagnosis with their captions.

use identify::Diagnosis;

use crate::output::diagnosis::extension::is_extended;
use crate::output::diagnosis::plots;
use crate::output::page::Figure;

/// All plots, in the order of the page.
pub(super) fn figures(diagnosis: &Diagnosis) -> Vec<Figure> {
    let figure = |name, caption, chart| Figure { name, caption, chart };
    let (readings, last) = if is_extended(diagnosis) {
        (
            "Readings compared with the original and the extended simulation, both free-run: their only input is the voltage.",
            "Autocorrelation of the extended simulation's whitened residual, with the 95 % interval of white noise.",
        )
    } else {
        (
            "Readings compared with the simulation in free run: its only input is the voltage.",
            "Autocorrelation of the simulation's whitened residual, with the 95 % interval of white noise.",
        )
    };
    vec![
        figure("readings.svg", readings, plots::readings(diagnosis)),
        figure("residual.svg", "Residual (reading minus simulation) over time.", plots::residual(diagnosis)),
        figure(
            "residual_voltage.svg",
            "Residual over the commanded voltage. A slope indicates a gain error, a curve a nonlinearity, two branches hysteresis or a lag.",
            plots::residual_by_voltage(diagnosis),
        ),
        figure("autocorrelation.svg", last, plots::autocorrelation(&diagnosis.report)),
        figure(
            "input_correlation.svg",
            "Correlation of the whitened residual with the changes of the voltage. White noise has none.",
            plots::input_correlation(&diagnosis.report),
        ),
    ]
}
