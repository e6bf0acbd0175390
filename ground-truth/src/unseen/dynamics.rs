//! Dynamics of amplifier and sensor: slew, transport, lags, filters, modes.

use std::collections::VecDeque;
use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

use crate::out_of_model::amplifier::delayed;
use crate::out_of_model::chain::{Chain, Lag, Now, Spectrum, paper};
use crate::out_of_model::draw::Draw;
use crate::physics::FULL_V;
use crate::unforeseen::law::{Law, PLAIN};
use crate::unforeseen::sensor::{Past, filtered, mode};

use super::readings::sensor;

/// Laws of the dynamics of amplifier and sensor.
pub const LAWS: [Law; 13] = [
    Law {
        name: "current limit by sign",
        first: &["amplifier-slew", "series-lag"],
        also: &["delay"],
        law: "du/dt = (command - u)/T within -k S and S, T 2 to 5 rows, 100 V at S in 6 to 15 rows, k 1.5 to 3 or its inverse",
        source: "Fleming, Leang, Design, Modeling and Control of Nanopositioning Systems, 2014: current limits of a piezo drive",
        build: current_limit,
        ..STEPS_ONLY
    },
    Law {
        name: "charger of constant power",
        first: &["amplifier-slew"],
        also: &["delay"],
        law: "d(u^2)/dt between -P and P; 0 V to full scale takes 15 to 40 rows",
        source: "Sokal, Redl, Control algorithms for optimal flyback-charging of a capacitor, IEEE Trans. Power Electron. 12, 1997",
        build: constant_power,
        ..STEPS_ONLY
    },
    Law {
        name: "dead time by direction",
        first: &["delay"],
        law: "commands up after d, commands down after k d, in their order; d 1.2 to 3 rows, at least 0.05 s, k 2 to 4; or the other way",
        source: "Isermann, Mechatronic Systems: Fundamentals, 2005: solenoid valves open and close after unlike times",
        build: dead_time_by_direction,
        ..STEPS_ONLY
    },
    Law {
        name: "transport by the flow",
        first: &["delay"],
        law: "u is the command that entered a pipe of 3 to 7 rows (at least 0.15 s) at a flow of 0.4 + 1.2 command/full scale",
        source: "Zenger, Niemi, Modelling and control of time-varying continuous flow processes, J. Process Control 19, 2009",
        build: transport,
        ..STEPS_ONLY
    },
    Law {
        name: "thermowell",
        first: &["series-lag", "delay"],
        also: &["instantaneous-share", "amplifier-slew"],
        law: "1/cosh(sqrt(s T)), diffusion through a layer, T 1 to 6 s",
        source: "Carslaw, Jaeger, Conduction of Heat in Solids, 1959",
        build: thermowell,
        ..STEPS_ONLY
    },
    Law {
        name: "tanks in series",
        first: &["series-lag", "delay"],
        also: &["instantaneous-share", "amplifier-slew"],
        law: "four equal lags in series of 0.15 to 0.6 s",
        source: "Levenspiel, Chemical Reaction Engineering, 1999: tanks in series",
        build: tanks,
        ..STEPS_ONLY
    },
    Law {
        name: "probe in a flow",
        first: &["series-lag"],
        also: &["instantaneous-share", "delay", "amplifier-slew", "voltage-dependent-time-constant"],
        law: "dz/dt = (y - z)/T, T = T0/(1 + a y/500 V), T0 1 to 3 s, a 2 to 6",
        source: "Incropera, DeWitt, Fundamentals of Heat and Mass Transfer, 2002: time constant of a thermocouple junction",
        build: probe,
        ..STEPS_ONLY
    },
    Law {
        name: "Butterworth filter",
        first: &["series-lag"],
        also: &["resonance", "instantaneous-share", "delay", "amplifier-slew"],
        law: "second order of the damping 0.71, corner at 0.15 to 0.6 Hz",
        source: "Butterworth, On the theory of filter amplifiers, Wireless Engineer 7, 1930",
        build: butterworth,
        ..STEPS_ONLY
    },
    Law {
        name: "running median",
        first: &["delay"],
        law: "median of the last 9 to 25 readings",
        source: "Tukey, Exploratory Data Analysis, 1977",
        build: median,
        ..STEPS_ONLY
    },
    Law {
        name: "slow converter",
        first: &["delay"],
        law: "a new reading every 5 to 12 rows, repeated in between",
        source: "Franklin, Powell, Workman, Digital Control of Dynamic Systems, 1998: a hold is late by half of its period",
        build: slow_converter,
        ..STEPS_ONLY
    },
    Law {
        name: "mode with dry friction",
        first: &["resonance"],
        law: "p'' = omega^2 (y - p) - 2 0.005 omega p' - omega^2 F sgn p', F 1 to 2.5 V: it decays linearly and stops",
        source: "Den Hartog, Forced vibrations with combined Coulomb and viscous friction, Trans. ASME 53, 1931",
        build: dry_friction,
        ..STEPS_ONLY
    },
    Law {
        name: "water hammer",
        first: &["resonance"],
        also: &["delay"],
        law: "z(t) = (1 + r) y(t - T) - r z(t - 2 T), r 0.5 to 0.8, T 1.5 to 4 rows: reflections in a line",
        source: "Wylie, Streeter, Fluid Transients in Systems, 1993",
        build: water_hammer,
        ..STEPS_ONLY
    },
    Law {
        name: "capacitive crosstalk",
        first: &["instantaneous-share"],
        also: &["charge-leakage"],
        law: "y + c (u - L), dL/dt = (u - L)/T, c 0.08 to 0.2, T 0.2 to 0.8 s",
        source: "Ott, Electromagnetic Compatibility Engineering, 2009: capacitive coupling",
        build: crosstalk,
        ..STEPS_ONLY
    },
];

/// A law that is visible after voltage steps only.
const STEPS_ONLY: Law = Law { needs_steps: true, ..PLAIN };

/// The paper's spring behind an amplifier `f` of the command, mixed as command + size (f(command) - command).
fn amplified(draw: &Draw, mut f: impl FnMut(f64, Now) -> f64 + 'static) -> Chain {
    let size = draw.size;
    Chain::before(Box::new(move |command, now| command + size * (f(command, now) - command)))
}

fn current_limit(draw: &mut Draw) -> Chain {
    let tau_s = draw.every_s * draw.between(2.0, 5.0);
    let up = 100.0 / (draw.every_s * draw.between(6.0, 15.0));
    let down = up * draw.between(1.5, 3.0).powf(draw.sign());
    let mut u = 0.0;
    amplified(draw, move |command, now| {
        let rate = |u: f64| ((command - u) / tau_s).clamp(-down, up);
        let middle = u + 0.5 * now.dt * rate(u);
        u += now.dt * rate(middle);
        u
    })
}

fn constant_power(draw: &mut Draw) -> Chain {
    let power = draw.full_v.powi(2) / (draw.every_s * draw.between(15.0, 40.0));
    let mut square = 0.0;
    amplified(draw, move |command, now| {
        square += (command.powi(2) - square).clamp(-power * now.dt, power * now.dt);
        square.sqrt()
    })
}

fn dead_time_by_direction(draw: &mut Draw) -> Chain {
    let short = draw.size * (draw.every_s * draw.between(1.2, 3.0)).max(0.05);
    let long = short * draw.between(2.0, 4.0);
    let [up, down] = if draw.sign() > 0.0 { [short, long] } else { [long, short] };
    Chain::before(delayed(move |_, change| if change > 0.0 { up } else { down }))
}

fn transport(draw: &mut Draw) -> Chain {
    let volume = draw.size * (draw.every_s * draw.between(3.0, 7.0)).max(0.15);
    // Commands over the volume that has entered, in s at a flow of 1.
    let (full_v, mut entered, mut pipe) = (draw.full_v, 0.0, Past::default());
    Chain::before(Box::new(move |command, now| {
        entered += now.dt * (0.4 + 1.2 * command / full_v);
        pipe.push(entered, command);
        pipe.at(entered - volume)
    }))
}

/// Step response of diffusion through a layer of the time `t`, in s, by its modes.
fn diffusion(t: f64) -> Spectrum {
    let mode = |k: i32| {
        let odd = f64::from(2 * k + 1);
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        (sign * 4.0 / (PI * odd), 4.0 * t / (PI * odd).powi(2))
    };
    Spectrum::new((0..40).map(mode)).normalised()
}

fn thermowell(draw: &mut Draw) -> Chain {
    let mut layer = diffusion(draw.log_between(1.0, 6.0));
    filtered(draw, move |y, now| layer.follow(y, now.dt))
}

fn tanks(draw: &mut Draw) -> Chain {
    let (tau_s, mut tanks) = (draw.log_between(0.15, 0.6), [Lag::default(); 4]);
    filtered(draw, move |y, now| tanks.iter_mut().fold(y, |y, tank| tank.follow(y, tau_s, now.dt)))
}

fn probe(draw: &mut Draw) -> Chain {
    let (still_s, a, mut z) = (draw.between(1.0, 3.0), draw.between(2.0, 6.0), Lag::default());
    filtered(draw, move |y, now| z.follow(y, still_s / (1.0 + a * y.max(0.0) / FULL_V), now.dt))
}

fn butterworth(draw: &mut Draw) -> Chain {
    let mut filter = mode(draw.log_between(0.15, 0.6), FRAC_1_SQRT_2, |_| 0.0);
    filtered(draw, move |y, now| y + filter(y, now))
}

fn median(draw: &mut Draw) -> Chain {
    let rows = 2 * draw.between(4.0, 13.0) as usize + 1;
    let mut last = VecDeque::new();
    sensor(draw, move |y, _| {
        last.push_back(y);
        if last.len() > rows {
            last.pop_front();
        }
        let mut sorted: Vec<f64> = last.iter().copied().collect();
        sorted.sort_by(f64::total_cmp);
        sorted[sorted.len() / 2]
    })
}

fn slow_converter(draw: &mut Draw) -> Chain {
    let rows = draw.between(5.0, 13.0) as usize;
    let (mut row, mut kept) = (0, 0.0);
    sensor(draw, move |y, _| {
        if row % rows == 0 {
            kept = y;
        }
        row += 1;
        kept
    })
}

fn dry_friction(draw: &mut Draw) -> Chain {
    let hertz = (draw.between(0.05, 0.2) / draw.every_s).max(0.3);
    let (omega, volts) = (TAU * hertz, draw.between(1.0, 2.5));
    // The sign is smooth below a hundredth of the rate after a step of 45 V, for the time steps.
    let slow = 0.01 * omega * 45.0;
    let mut mode = mode(hertz, 0.005, move |rate| omega * omega * volts * (rate / slow).tanh());
    filtered(draw, move |y, now| y + mode(y, now))
}

fn water_hammer(draw: &mut Draw) -> Chain {
    let (late_s, r) = (draw.every_s * draw.between(1.5, 4.0), draw.between(0.5, 0.8));
    let (mut incoming, mut reflected) = (Past::default(), Past::default());
    filtered(draw, move |y, now| {
        incoming.push(now.t, y);
        let z = (1.0 + r) * incoming.at(now.t - late_s) - r * reflected.at(now.t - 2.0 * late_s);
        reflected.push(now.t, z);
        z
    })
}

fn crosstalk(draw: &mut Draw) -> Chain {
    let (part, tau_s) = (draw.sized(0.08, 0.2), draw.between(0.2, 0.8));
    let (mut paper, mut slow) = (paper(), Lag::default());
    Chain::of(Box::new(move |u, now| paper(u, now) + part * (u - slow.follow(u, tau_s, now.dt))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Schedule;
    use crate::unforeseen::tests::draw;

    #[test]
    fn what_has_a_static_gain_of_1_settles_at_the_voltage() {
        let time_s: Vec<f64> = (0..1000).map(|k| 0.1 * f64::from(k)).collect();
        let hold = Schedule { voltage_v: vec![500.0; 1000], time_s };
        for law in LAWS {
            let end = (law.build)(&mut draw(1.0)).stiffness(&hold, 60)[999];
            assert!((end - 500.0).abs() < 3.0, "{law:?}: {end} V");
        }
    }

    #[test]
    fn diffusion_through_a_layer_is_half_done_after_0_38_of_its_time() {
        let mut layer = diffusion(2.0);
        layer.follow(1.0, 0.0);
        let half = layer.follow(1.0, 2.0 * 0.379);
        assert!((half - 0.5).abs() < 0.01, "{half}");
    }
}
