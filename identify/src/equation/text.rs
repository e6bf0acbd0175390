//! An equation as plain ASCII mathematics, with the names of its parameters in their order.

use crate::equation::clock::Term;
use crate::equation::curve::Curve;
use crate::equation::kind::Kind;
use crate::equation::lag::By;
use crate::equation::operator::Operator;
use crate::equation::structure::Structure;

/// An equation in words of mathematics.
#[derive(Clone, Debug, PartialEq)]
pub struct Text {
    /// The equation, its intermediate signals after semicolons.
    pub equation: String,
    /// What each function in it is.
    pub definitions: Vec<&'static str>,
    /// Names of the linear coefficients, in their order.
    pub linear: Vec<String>,
    /// Names of the other parameters, in the order of [`Structure::visit`], then those of the times of steps of terms.
    pub others: Vec<String>,
}

/// Numbers the names of parameters.
#[derive(Default)]
struct Names {
    given: Vec<String>,
}

impl Names {
    /// Returns the next name that starts with a letter.
    fn next(&mut self, letter: &str) -> String {
        let same = |name: &&String| name.trim_end_matches(|of: char| of.is_ascii_digit()) == letter;
        let name = format!("{letter}{}", self.given.iter().filter(same).count() + 1);
        self.given.push(name.clone());
        name
    }
}

/// Returns the text of a structure; `free_start` says that the spring may not have been at rest at the first row.
pub fn text(structure: &Structure, free_start: bool) -> Text {
    let mut names = Names::default();
    let mut definitions = Vec::new();
    let mut lines = Vec::new();
    let mut last = "u".to_owned();
    let linear_end = structure.is_linear_at_end();
    let before_last = structure.chain.len() - usize::from(linear_end);
    for (index, operator) in structure.chain[..before_last].iter().enumerate() {
        let made = function(operator, &last, &mut names, &mut definitions);
        last = if index + 1 == before_last && before_last == 1 { "v".into() } else { format!("v{}", index + 1) };
        lines.push(format!("{last} = {made}"));
    }
    let mut linear = vec!["c0".to_owned()];
    let mut sum = String::from("y = c0");
    match structure.last_sum() {
        None => sum += &format!(" + {last}"),
        Some(of) => {
            for chain in &of.chains {
                let weight = format!("c{}", linear.len());
                sum += &format!(" + {weight} {}", nested(chain, &last, &mut names, &mut definitions));
                linear.push(weight);
            }
        }
    }
    // Times of steps are no coordinates: their names come last.
    let mut steps = Vec::new();
    for term in &structure.terms {
        let mut amplitude = || {
            let name = format!("c{}", linear.len());
            linear.push(name.clone());
            name
        };
        sum += &match term {
            Term::Sine(_) => {
                let (cosine, sine) = (amplitude(), amplitude());
                let f = names.next("f");
                format!(" + {cosine} cos(2 pi {f} t) + {sine} sin(2 pi {f} t)")
            }
            Term::Ramp => format!(" + {} t/L", amplitude()),
            Term::Step(_) => {
                steps.push(format!("s{}", steps.len() + 1));
                format!(" + {} [t >= {}]", amplitude(), steps[steps.len() - 1])
            }
        };
    }
    if free_start {
        sum += " + start";
        define(&mut definitions, "start: free response of the unknown state at the first row");
    }
    lines.reverse();
    let equation = std::iter::once(sum).chain(lines).collect::<Vec<_>>().join("; ");
    definitions.sort_unstable();
    Text { equation, definitions, linear, others: [names.given, steps].concat() }
}

fn define(definitions: &mut Vec<&'static str>, definition: &'static str) {
    if !definitions.contains(&definition) {
        definitions.push(definition);
    }
}

/// Returns a chain of operators as nested functions of `of`.
fn nested(chain: &[Operator], of: &str, names: &mut Names, definitions: &mut Vec<&'static str>) -> String {
    chain.iter().fold(of.to_owned(), |of, operator| function(operator, &of, names, definitions))
}

/// Returns an operator as a function of `x`.
fn function(operator: &Operator, x: &str, names: &mut Names, definitions: &mut Vec<&'static str>) -> String {
    let mut name = |letter: &str| names.next(letter);
    let (text, definition) = match operator.kind {
        Kind::Lag => (format!("lag({x}, {})", name("T")), "lag(x, T) = w, T dw/dt = x - w"),
        Kind::Varying(By::Direction) => (
            format!("lagd({x}, {}, {})", name("T"), name("a")),
            "lagd(x, T, a) = w, T exp(a sign(x - w)) dw/dt = x - w",
        ),
        Kind::Varying(By::State) => {
            (format!("lags({x}, {}, {})", name("T"), name("a")), "lags(x, T, a) = w, T exp(a w/F) dw/dt = x - w")
        }
        Kind::Varying(By::Input) => {
            (format!("lagu({x}, {}, {})", name("T"), name("a")), "lagu(x, T, a) = w, T (1 + a x/F) dw/dt = x - w")
        }
        Kind::Varying(By::Distance) => (
            format!("lagx({x}, {}, {})", name("T"), name("a")),
            "lagx(x, T, a) = w, T dw/dt = (F/a) sinh(a (x - w)/F); for a < 0 the reciprocal of that factor on T",
        ),
        Kind::Second => (
            format!("second({x}, {}, {})", name("f"), name("z")),
            "second(x, f, z) = w, w''/(2 pi f)^2 + 2 z w'/(2 pi f) + w = x",
        ),
        Kind::Creep => (
            format!("creep({x}, {})", name("p")),
            "creep(x, p): lags from the rows' spacing to the record's length with weights T^p",
        ),
        Kind::Play => (
            format!("play({x}, {}, {})", name("r"), name("a")),
            "play(x, r, a) = (1 - a) x + a w, w the play operator of half-width r",
        ),
        Kind::Travel => {
            (format!("drag({x}, {}, {})", name("r"), name("a")), "drag(x, r, a) = (1 - a) x + a w, r dw = (x - w) |dx|")
        }
        Kind::Direction => {
            (format!("way({x}, {})", name("a")), "way(x, a) = x (1 + a) after a rise, x (1 - a) after a fall")
        }
        Kind::Curve(curve) => match curve {
            Curve::Square => (format!("square({x}, {})", name("a")), "square(x, a) = x + a x (|x|/F - 1)"),
            Curve::Cube => (format!("cube({x}, {})", name("a")), "cube(x, a) = x + a x ((x/F)^2 - 1)"),
            Curve::Even => (format!("even({x}, {})", name("a")), "even(x, a) = x + a (x^2/F - x)"),
            Curve::Power => (format!("power({x}, {})", name("p")), "power(x, p) = F sign(x) |x/F|^p"),
            Curve::Tanh => (format!("soft({x}, {})", name("a")), "soft(x, a) = F tanh(a x/F)/tanh(a)"),
            Curve::Limit => (format!("limit({x}, {})", name("r")), "limit(x, r) = x, at most r in magnitude"),
            Curve::Floor => (format!("floor({x}, {})", name("r")), "floor(x, r) = max(x, r)"),
            Curve::DeadBand => (format!("dead({x}, {})", name("r")), "dead(x, r) = sign(x) max(|x| - r, 0)"),
        },
        Kind::Delay => (format!("delay({x}, {})", name("T")), "delay(x, T) = x(t - T)"),
        Kind::Slew => (format!("slew({x}, {})", name("s")), "slew(x, s): follows x at most at the rate s"),
        Kind::Swing => {
            let (f, a, b) = (name("f"), name("a"), name("a"));
            (format!("{x} (1 + {a} cos(2 pi {f} t) + {b} sin(2 pi {f} t))"), "t: time since the first row")
        }
        Kind::Grow => (format!("{x} (1 + {} t/L)", name("a")), "L: length of the record"),
        Kind::Step => {
            let at = name("t");
            (format!("{x} (1 + {} [t >= {at}])", name("a")), "[..]: 1 if true, else 0")
        }
        Kind::Times => {
            let a = name("a");
            let inside = nested(&operator.chains[0], x, names, definitions);
            (format!("{x} (1 + {a} {inside}/F)"), "F: largest magnitude of the voltage")
        }
        Kind::Parallel => {
            let weights: Vec<String> = operator.chains.iter().map(|_| names.next("b")).collect();
            let each = weights.iter().zip(&operator.chains);
            let each: Vec<String> =
                each.map(|(weight, chain)| format!("{weight} {}", nested(chain, x, names, definitions))).collect();
            return each.join(" + ");
        }
    };
    define(definitions, definition);
    if definition.contains("/F") || definition.contains("= F") {
        define(definitions, "F: largest magnitude of the voltage");
    }
    text
}
