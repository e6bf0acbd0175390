//! Friction and backlash after the relaxation, and a response that depends on the direction.

use super::hysteresis::mixed;
use super::law::{Law, PLAIN};
use crate::out_of_model::chain::{Chain, Stage};
use crate::out_of_model::draw::Draw;

/// Laws of friction, backlash and direction.
pub const LAWS: [Law; 4] = [
    Law {
        name: "stick-slip",
        first: &["hysteresis"],
        also: &["quantisation"],
        law: "the relaxed response y sticks until it is a from its place, then slips to b from it; a 15 to 35 V, b 0.2 a to 0.5 a",
        source: "Armstrong-Helouvry, Dupont, Canudas de Wit, Friction in servo machines, Automatica 30, 1994",
        build: stick_slip,
        ..PLAIN
    },
    Law {
        name: "backlash of the sensor",
        first: &["hysteresis"],
        law: "the relaxed response y through a play of 16 to 50 V",
        source: "Nordin, Gutman, Controlling mechanical systems with backlash, Automatica 38, 2002",
        build: backlash,
        ..PLAIN
    },
    Law {
        name: "play that widens with the rate",
        first: &["hysteresis"],
        also: &["time-constant", "series-lag"],
        law: "the relaxed response y through a play of radius r + k |dy/dt|, r 8 to 18 V, k 0.1 to 0.3 s, at most 3 r",
        source: "Ang, Khosla, Riviere, Feedforward with inverse rate-dependent model, IEEE/ASME Trans. Mechatronics 12, 2007",
        build: rate_dependent,
        ..PLAIN
    },
    Law {
        name: "gain by direction",
        first: &["hysteresis"],
        also: &["gain-error"],
        law: "v = (1 + a) u after a command up, (1 - a) u after one down, a 0.03 to 0.08, either sign",
        source: "Godfrey, Briggs, Identification of processes with direction-dependent dynamic responses, Proc. IEE 119, 1972",
        build: by_direction,
        ..PLAIN
    },
];

/// The paper's spring followed by a law `f` of the response y and its rate, mixed as y + size (f(y) - y).
fn after(draw: &Draw, mut f: impl FnMut(f64, f64) -> f64 + 'static) -> Chain {
    let (size, mut last, mut rate) = (draw.size, 0.0, 0.0);
    let stage: Stage = Box::new(move |y, now| {
        if now.dt > 0.0 {
            rate = (y - last) / now.dt;
        }
        last = y;
        y + size * (f(y, rate) - y)
    });
    Chain::after(stage)
}

fn stick_slip(draw: &mut Draw) -> Chain {
    let breakaway = draw.between(15.0, 35.0);
    let (kept, mut place) = (breakaway * draw.between(0.2, 0.5), 0.0f64);
    after(draw, move |y, _| {
        let off = y - place;
        if off.abs() > breakaway {
            place = y - kept * off.signum();
        }
        place
    })
}

fn backlash(draw: &mut Draw) -> Chain {
    let (radius, mut place) = (draw.between(8.0, 25.0), 0.0f64);
    after(draw, move |y, _| {
        place = place.clamp(y - radius, y + radius);
        place
    })
}

fn rate_dependent(draw: &mut Draw) -> Chain {
    let (least, per_rate, mut place) = (draw.between(8.0, 18.0), draw.between(0.1, 0.3), 0.0f64);
    after(draw, move |y, rate| {
        let radius = (least + per_rate * rate.abs()).min(3.0 * least);
        place = place.clamp(y - radius, y + radius);
        place
    })
}

fn by_direction(draw: &mut Draw) -> Chain {
    let a = draw.sign() * draw.between(0.03, 0.08);
    let mut last = 0.0;
    mixed(draw, move |u| {
        let sign = if u > last { 1.0 } else { -1.0 };
        last = u;
        u * (1.0 + sign * a)
    })
}
