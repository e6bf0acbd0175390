//! A signal of straight pieces with jumps between them, and the blocks that map one such signal to another.

/// Durations up to this, in s, are rounding errors.
const ROUNDING_S: f64 = 1e-9;

/// Relative difference up to which durations of pieces are the same: those of a uniformly sampled record differ by rounding.
pub(super) const SAME_DURATION: f64 = 1e-9;

/// One straight piece of a signal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Piece {
    /// Duration, in s; 0 for the piece of the last row.
    pub duration_s: f64,
    /// Value at the start.
    pub from: f64,
    /// Limit of the value at the end.
    pub to: f64,
}

/// Number of straight pieces that follow a root over one piece of its square.
const PARTS_OF_ROOT: usize = 4;
/// Largest number of straight pieces that follow a lag over one piece of its input, their duration in time constants, and the distance
/// from the settled output, in V, from which one is enough.
const PARTS_OF_LAG: usize = 14;
const LAGS_PER_PART: f64 = 0.4;
const SETTLED_V: f64 = 1e-3;

/// A signal over time: contiguous straight pieces, which may jump at their borders.
#[derive(Debug, Default)]
pub struct Signal {
    /// Constant value before the first piece.
    pub before: f64,
    pub(super) pieces: Vec<Piece>,
    /// Index of the piece that starts at each row.
    pub(super) rows: Vec<u32>,
}

impl Clone for Signal {
    fn clone(&self) -> Self {
        Self { before: self.before, pieces: self.pieces.clone(), rows: self.rows.clone() }
    }

    fn clone_from(&mut self, source: &Self) {
        self.before = source.before;
        self.pieces.clone_from(&source.pieces);
        self.rows.clone_from(&source.rows);
    }
}

impl Signal {
    /// Returns the number of pieces.
    pub fn len(&self) -> usize {
        self.pieces.len()
    }

    /// Returns true if there is no piece.
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Returns true if the signal is 0 at all times.
    pub fn is_zero(&self) -> bool {
        self.before == 0.0 && self.pieces.iter().all(|piece| piece.from == 0.0 && piece.to == 0.0)
    }

    /// Becomes a signal with the pieces of another that is 0 at all times.
    pub fn silence_as(&mut self, other: &Self) {
        self.before = 0.0;
        self.pieces.clear();
        self.pieces.extend(other.pieces.iter().map(|piece| Piece { from: 0.0, to: 0.0, ..*piece }));
        self.rows.clone_from(&other.rows);
    }

    /// Returns the pieces in the order of time.
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Returns the pieces in the order of time, each with whether a row is at its start.
    pub fn pieces_and_rows(&self) -> impl Iterator<Item = (Piece, bool)> {
        let mut rows = self.rows.iter().peekable();
        let with_row =
            move |(index, piece): (usize, &Piece)| (*piece, rows.next_if(|&&row| row as usize == index).is_some());
        self.pieces.iter().enumerate().map(with_row)
    }

    /// Returns the number of pieces for which a filter has to compute its factors anew: those that are as long as neither of the last two
    /// different durations. A delay that divides every row into the same two pieces makes none.
    pub fn new_durations(&self) -> usize {
        let same = |one: f64, other: f64| (one - other).abs() <= SAME_DURATION * one;
        let mut known = self.pieces.first().map_or([0.0; 2], |piece| [piece.duration_s; 2]);
        let mut new = 0;
        for &Piece { duration_s, .. } in &self.pieces {
            if same(duration_s, known[0]) {
                continue;
            }
            new += usize::from(!same(duration_s, known[1]));
            known = [duration_s, known[0]];
        }
        new
    }

    /// Returns the duration of each piece, in s.
    pub fn durations_s(&self) -> impl Iterator<Item = f64> {
        self.pieces.iter().map(|piece| piece.duration_s)
    }

    /// Returns the value just after the time of each row.
    pub fn at_rows(&self) -> impl Iterator<Item = f64> {
        self.rows.iter().map(|&piece| self.pieces[piece as usize].from)
    }

    /// Replaces the contents of `middles` by the value in the middle of each piece.
    pub fn middles(&self, middles: &mut Vec<f64>) {
        middles.clear();
        middles.extend(self.pieces.iter().map(|piece| (piece.from + piece.to) / 2.0));
    }

    /// Applies a law to start and end of every piece, in order of time; the law must return the same for a value that
    /// repeats.
    pub fn map(&mut self, mut law: impl FnMut(f64) -> f64) {
        // Most pieces are constant and continue the previous one, and laws are expensive.
        let (mut last, mut made) = (self.before, law(self.before));
        let mut law = |value: f64| {
            if value != last {
                (last, made) = (value, law(value));
            }
            made
        };
        self.before = law(self.before);
        for piece in &mut self.pieces {
            piece.from = law(piece.from);
            piece.to = law(piece.to);
        }
    }

    /// Replaces start and end of each piece, in order of time, by what a block returns for it.
    pub fn pass(&mut self, mut block: impl FnMut(Piece) -> (f64, f64)) {
        for piece in &mut self.pieces {
            (piece.from, piece.to) = block(*piece);
        }
    }

    /// Replaces the signal by its mean over the last `window_s` seconds, in s; between starts of pieces it is straight.
    pub fn average(&mut self, window_s: f64) {
        let input = self.pieces.clone();
        // Integral of the input from the start of the signal, and from there back to the start of the window, which is `ago` s into
        // the piece `oldest`; before the first piece the input is constant.
        let integral = |piece: &Piece, until_s: f64| {
            let slope = if piece.from == piece.to { 0.0 } else { (piece.to - piece.from) / piece.duration_s };
            until_s * (piece.from + 0.5 * slope * until_s)
        };
        let (mut now_s, mut area) = (0.0, 0.0);
        let (mut oldest, mut oldest_s, mut oldest_area) = (0, 0.0, 0.0);
        let mut mean = |now_s: f64, area: f64| {
            let from_s = now_s - window_s;
            if from_s <= 0.0 {
                return (area - from_s * self.before) / window_s;
            }
            while oldest_s + input[oldest].duration_s < from_s && oldest + 1 < input.len() {
                oldest_area += integral(&input[oldest], input[oldest].duration_s);
                oldest_s += input[oldest].duration_s;
                oldest += 1;
            }
            (area - oldest_area - integral(&input[oldest], from_s - oldest_s)) / window_s
        };
        let mut start = mean(0.0, 0.0);
        for piece in &mut self.pieces {
            area += integral(piece, piece.duration_s);
            now_s += piece.duration_s;
            let end = mean(now_s, area);
            (piece.from, piece.to) = (start, end);
            start = end;
        }
    }

    /// Returns the signal delayed by `delay_s`, in s; rows keep their times.
    pub fn delayed(&self, delay_s: f64) -> Self {
        let constant = Piece { duration_s: delay_s, from: self.before, to: self.before };
        let all = std::iter::once(constant).chain(self.pieces.iter().copied()).filter(|p| p.duration_s > ROUNDING_S);
        let mut source = all.peekable();
        // Constant pieces are joined, so that they are not divided where their rows were.
        let mut next = || {
            let mut piece = source.next()?;
            let stays = |to: &Piece| [piece.from, to.from, to.to] == [piece.to; 3];
            while let Some(more) = source.next_if(stays) {
                piece.duration_s += more.duration_s;
            }
            Some(piece)
        };
        let mut rest = next().unwrap_or(constant);
        self.rebuilt(|piece, pieces| {
            let mut left = piece.duration_s;
            loop {
                if rest.duration_s <= ROUNDING_S {
                    let end = Piece { duration_s: f64::INFINITY, from: rest.to, to: rest.to };
                    rest = next().unwrap_or(end);
                }
                let taken = left.min(rest.duration_s);
                let slope = if rest.from == rest.to { 0.0 } else { (rest.to - rest.from) / rest.duration_s };
                let until = rest.from + slope * taken;
                pieces.push(Piece { duration_s: taken, from: rest.from, to: until });
                rest = Piece { duration_s: rest.duration_s - taken, from: until, ..rest };
                left -= taken;
                if left <= ROUNDING_S {
                    break;
                }
            }
        })
    }

    /// Returns a signal that follows this one at rates of at most `rising` and `falling`, in V/s, both positive.
    pub fn slewed(&self, rising: f64, falling: f64) -> Self {
        let mut now = self.before;
        self.rebuilt(|Piece { duration_s, from, to }, pieces| {
            let slope = if duration_s > 0.0 { (to - from) / duration_s } else { 0.0 };
            let mut left = duration_s;
            if from != now {
                let ahead = from - now;
                let rate = if ahead > 0.0 { rising } else { -falling };
                // Time until the output meets the line of the input.
                let closing = rate - slope;
                let meets = if closing * ahead > 0.0 { ahead / closing } else { f64::INFINITY };
                let taken = meets.clamp(0.0, left);
                pieces.push(Piece { duration_s: taken, from: now, to: now + rate * taken });
                now += rate * taken;
                left -= taken;
            }
            if left > ROUNDING_S || duration_s == 0.0 && from == now {
                // The line may be steeper than the rate of the other direction.
                let slope = slope.clamp(-falling, rising);
                pieces.push(Piece { duration_s: left, from: now, to: now + slope * left });
                now += slope * left;
            }
        })
    }

    /// Returns the output of an amplifier of one time constant, in s, that follows this signal at a rate of at most `slew`, in V/s, both
    /// positive: `du/dt = (v - u) / tau` within `-slew` to `slew`.
    pub fn followed(&self, slew: f64, tau_s: f64) -> Self {
        let mut now = self.before;
        self.rebuilt(|Piece { duration_s, from, to }, pieces| {
            let slope = if duration_s > 0.0 { (to - from) / duration_s } else { 0.0 };
            let mut passed_s = 0.0;
            for part in 0..PARTS_OF_LAG {
                let (ahead, left_s) = (from + slope * passed_s - now, duration_s - passed_s);
                let beyond = ahead.abs() - slew * tau_s;
                let is_last = part + 1 == PARTS_OF_LAG;
                let (taken_s, then) = if beyond > 1e-9 * slew * tau_s && !is_last {
                    let rate = slew.copysign(ahead);
                    let closing = slew - slope * ahead.signum();
                    // A little longer, so that rounding does not leave it beyond.
                    let taken_s = if closing > 0.0 { left_s.min(1.000_001 * beyond / closing) } else { left_s };
                    (taken_s, now + rate * taken_s)
                } else {
                    let unsettled = ahead - slope * tau_s;
                    let takes_all = is_last || unsettled.abs() < SETTLED_V;
                    let taken_s = if takes_all { left_s } else { left_s.min(LAGS_PER_PART * tau_s) };
                    let behind = slope * tau_s + unsettled * (-taken_s / tau_s).exp();
                    (taken_s, from + slope * (passed_s + taken_s) - behind)
                };
                pieces.push(Piece { duration_s: taken_s, from: now, to: then });
                (now, passed_s) = (then, passed_s + taken_s);
                if duration_s - passed_s <= ROUNDING_S {
                    break;
                }
            }
        })
    }

    /// Returns the output of a charger of bounded power that follows the signal: the output's square, with its sign, changes by at most
    /// `rate` per s.
    pub fn charged(&self, rate: f64) -> Self {
        let mut square = self.clone();
        square.map(|value| value * value.abs());
        let square = square.slewed(rate, rate);
        let root = |square: f64| square.abs().sqrt().copysign(square);
        let mut charged = square.rebuilt(|Piece { duration_s, from, to }, pieces| {
            let [start, end] = [from, to].map(root);
            let is_bound = (to - from).abs() > 0.999 * rate * duration_s;
            let parts = if is_bound && to != from { PARTS_OF_ROOT } else { 1 };
            let (mut last, mut passed_s) = (start, 0.0);
            for part in 1..=parts {
                // Straight between equally spaced outputs, which the square passes at known times.
                let output = start + (end - start) * part as f64 / parts as f64;
                let at_s =
                    if part == parts { duration_s } else { (output * output.abs() - from) / (to - from) * duration_s };
                pieces.push(Piece { duration_s: at_s - passed_s, from: last, to: output });
                (last, passed_s) = (output, at_s);
            }
        });
        charged.before = self.before;
        charged
    }

    /// Returns the magnitude of the signal; a piece that crosses zero becomes two.
    pub fn magnitude(&self) -> Self {
        let mut magnitude = self.rebuilt(|Piece { duration_s, from, to }, pieces| {
            let crossing_s = duration_s * from / (from - to);
            if from * to < 0.0 && crossing_s > 0.0 && crossing_s < duration_s {
                pieces.push(Piece { duration_s: crossing_s, from: from.abs(), to: 0.0 });
                pieces.push(Piece { duration_s: duration_s - crossing_s, from: 0.0, to: to.abs() });
            } else {
                pieces.push(Piece { duration_s, from: from.abs(), to: to.abs() });
            }
        });
        magnitude.before = self.before.abs();
        magnitude
    }

    /// Returns the signal with its values multiplied by `value`, and its durations by `duration`, both positive.
    pub fn scaled(&self, duration: f64, value: f64) -> Self {
        let mut scaled = self.clone();
        scaled.before *= value;
        for piece in &mut scaled.pieces {
            *piece = Piece { duration_s: duration * piece.duration_s, from: value * piece.from, to: value * piece.to };
        }
        scaled
    }

    /// Returns the signal with other pieces in place of each, which `put` appends; rows keep their times.
    fn rebuilt(&self, mut put: impl FnMut(Piece, &mut Vec<Piece>)) -> Self {
        let mut rebuilt = self.emptied();
        let mut rows = self.rows.iter().peekable();
        for (index, piece) in self.pieces.iter().enumerate() {
            if rows.next_if(|&&row| row as usize == index).is_some() {
                rebuilt.start_row();
            }
            put(*piece, &mut rebuilt.pieces);
        }
        rebuilt
    }

    fn emptied(&self) -> Self {
        Self {
            before: self.before,
            pieces: Vec::with_capacity(2 * self.pieces.len()),
            rows: Vec::with_capacity(self.rows.len()),
        }
    }

    pub(super) fn start_row(&mut self) {
        self.rows.push(self.pieces.len() as u32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use simulation::record::Record;
    use simulation::schedule::{Between, Schedule};

    fn step() -> Signal {
        let text = "time_s,voltage_v\n0,0\n1,100\n2,100\n3,100\n4,0\n";
        let record = Record::parse("r", text, "stiffness").unwrap();
        Signal::new(&Schedule::from_record(&record, Between::Hold), &[0.0, 1.0, 2.0, 3.0, 4.0], 0.0)
    }

    /// The first quarter of the time takes half of the voltage.
    #[test]
    fn charged_signal_follows_the_root_of_the_energy() {
        // 100 V hold 10 000 V^2.
        let got = rows(&step().charged(2500.0));
        let expected = [0.0, 0.0, 50.0, 5000f64.sqrt(), 7500f64.sqrt()];
        assert!(got.iter().zip(expected).all(|(got, expected)| (got - expected).abs() < 1e-9), "{got:?}");
        assert_eq!(rows(&step().charged(1e9)), [0.0, 0.0, 100.0, 100.0, 100.0]);
        let finer = step().charged(2500.0);
        let area: f64 = finer.pieces().iter().map(|piece| piece.duration_s * 0.5 * (piece.from + piece.to)).sum();
        // The integral of 100 V sqrt(t / 4 s) over 3 s. One straight line a piece would be off by 0.0018.
        let exact = 100.0 * 3f64.sqrt();
        assert!((area / exact - 1.0).abs() < 5e-4, "{area} instead of {exact}");
    }

    #[test]
    fn a_delay_makes_no_new_durations_and_a_slew_limit_does() {
        let volts = |row: usize| format!("{row},{}\n", [0, 70, 30, 90, 20][row * row % 5]);
        let text = format!("time_s,voltage_v\n{}", (0..40).map(volts).collect::<String>());
        let record = Record::parse("r", &text, "stiffness").unwrap();
        let time_s: Vec<f64> = (0..40).map(f64::from).collect();
        let signal = Signal::new(&Schedule::from_record(&record, Between::Hold), &time_s, 0.0);
        assert!(signal.new_durations() <= 1, "{}", signal.new_durations());
        let delayed = signal.delayed(0.3);
        assert!(delayed.len() > 60 && delayed.new_durations() <= 4, "{} {}", delayed.len(), delayed.new_durations());
        let slewed = signal.slewed(110.0, 110.0);
        assert!(slewed.new_durations() > 20, "{} {}", slewed.len(), slewed.new_durations());
    }

    fn rows(signal: &Signal) -> Vec<f64> {
        signal.at_rows().collect()
    }

    #[test]
    fn row_at_a_jump_has_the_voltage_after_it() {
        assert_eq!(rows(&step()), [0.0, 100.0, 100.0, 100.0, 0.0]);
    }

    #[test]
    fn delay_moves_jumps_between_and_onto_rows() {
        assert_eq!(rows(&step().delayed(0.5)), [0.0, 0.0, 100.0, 100.0, 100.0]);
        assert_eq!(rows(&step().delayed(1.5)), [0.0, 0.0, 0.0, 100.0, 100.0]);
        assert_eq!(rows(&step().delayed(9.0)), [0.0; 5]);
    }

    #[test]
    fn magnitude_of_a_ramp_through_zero_has_a_kink() {
        let mut ramp = step();
        let rises = ramp.rows[1] as usize;
        for (part, piece) in ramp.pieces[rises..].iter_mut().enumerate() {
            (piece.from, piece.to) = if part == 0 { (-30.0, 10.0) } else { (10.0, 10.0) };
        }
        let magnitude = ramp.magnitude();
        let kink = &magnitude.pieces[rises..rises + 2];
        assert_eq!((kink[0].from, kink[0].to, kink[1].from, kink[1].to), (30.0, 0.0, 0.0, 10.0));
        assert!((kink[0].duration_s - 3.0 * kink[1].duration_s).abs() < 1e-12);
        assert_eq!(rows(&magnitude), [0.0, 30.0, 10.0, 10.0, 10.0]);
    }

    #[test]
    fn mean_over_a_window_ramps_from_level_to_level() {
        for (window_s, expected) in [(2.0, [0.0, 0.0, 50.0, 100.0, 100.0]), (4.0, [0.0, 0.0, 25.0, 50.0, 75.0])] {
            let mut mean = step();
            mean.average(window_s);
            assert!(rows(&mean).iter().zip(expected).all(|(got, expected)| (got - expected).abs() < 1e-9), "{mean:?}");
        }
        let mut constant = step();
        constant.before = 7.0;
        constant.pieces.iter_mut().for_each(|piece| (piece.from, piece.to) = (7.0, 7.0));
        constant.average(2.5);
        assert!(rows(&constant).iter().all(|value| (value - 7.0).abs() < 1e-12));
    }

    #[test]
    fn slew_limited_step_has_the_expected_ramp() {
        let got = rows(&step().slewed(40.0, 40.0));
        for (got, expected) in got.iter().zip([0.0, 0.0, 40.0, 80.0, 100.0]) {
            assert!((got - expected).abs() < 1e-9, "{got} {expected}");
        }
        assert_eq!(rows(&step().slewed(1e6, 1e6)), [0.0, 0.0, 100.0, 100.0, 100.0]);
    }

    #[test]
    fn a_line_that_crosses_a_slewed_output_is_followed_at_the_rate() {
        let record = Record::parse("r", "time_s,voltage_v\n0,0\n1,100\n2,-100\n", "stiffness").unwrap();
        let triangle = Signal::new(&Schedule::from_record(&record, Between::Linear), &[0.0, 1.0, 2.0], 0.0);
        // They meet at 1.25 s and 50 V, where the line falls by 200 V/s.
        let got = rows(&triangle.slewed(40.0, 40.0));
        assert!(got.iter().zip([0.0, 40.0, 20.0]).all(|(got, expected)| (got - expected).abs() < 1e-9), "{got:?}");
    }

    /// Compared with steps of a thousandth of a row.
    #[test]
    fn an_amplifier_of_one_time_constant_slews_far_from_its_input() {
        let (slew, tau_s) = (40.0, 0.7);
        let input = step();
        let output = input.followed(slew, tau_s);
        let (mut now, mut expected) = (input.before, Vec::new());
        for piece in input.pieces() {
            let steps = (1000.0 * piece.duration_s) as usize;
            for step in 0..steps {
                let voltage = piece.from + (piece.to - piece.from) * step as f64 / steps as f64;
                now += ((voltage - now) / tau_s).clamp(-slew, slew) * piece.duration_s / steps as f64;
            }
            expected.push(now);
        }
        let (mut pieces, mut passed_s, mut until_s) = (output.pieces().iter(), 0.0, 0.0);
        for (piece, expected) in input.pieces().iter().zip(expected) {
            until_s += piece.duration_s;
            let mut end = None;
            while passed_s < until_s - 1e-9 {
                let piece = pieces.next().unwrap();
                (passed_s, end) = (passed_s + piece.duration_s, Some(piece.to));
            }
            assert!(end.is_none_or(|end| (end - expected).abs() < 0.2), "{end:?} {expected}");
        }
    }

    #[test]
    fn rising_and_falling_slew_rates_are_independent() {
        let mut up_and_down = step();
        let falls = up_and_down.rows[3] as usize;
        up_and_down.pieces[falls..].iter_mut().for_each(|piece| (piece.from, piece.to) = (0.0, 0.0));
        for (rising, falling, expected) in
            [(40.0, 70.0, [0.0, 0.0, 40.0, 80.0, 10.0]), (70.0, 40.0, [0.0, 0.0, 70.0, 100.0, 60.0])]
        {
            let got = rows(&up_and_down.slewed(rising, falling));
            assert!(got.iter().zip(expected).all(|(got, expected)| (got - expected).abs() < 1e-9), "{got:?}");
        }
    }
}
