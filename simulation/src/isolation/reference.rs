//! Reference of [`model::isolation`] in double precision: the same equations and constants, written independently, with the whole work
//! of a block in its last tick.

use model::isolation::bank::{self, *};
use model::isolation::{Cause, Settings, Verdict, thresholds};

/// The bank with its state.
#[derive(Clone, Debug)]
pub struct Bank {
    settings: Settings,
    ticks: u32,
    block_s: f64,
    sigma_v: f64,
    correlation: f64,
    sums: Sums,
    filters: Filters,
    /// Number of blocks since the sums were restarted.
    age: u32,
    rate_hz: f64,
    since_decision: u32,
    last: ([f64; VECTORS], f64),
    upward: [f64; SMALLEST.len()],
    downward: [f64; SMALLEST.len()],
    energy: f64,
    products: Vec<Vec<Vec<f64>>>,
    released: (bool, bool),
    pinned_at: Option<f64>,
    /// Number of blocks in the sums.
    blocks: u32,
    /// True after a sequential test has exceeded its threshold.
    alarmed: bool,
    proposed: Verdict,
    agreed: u32,
    against: u32,
    /// The last decision that enough rounds in a row agree on.
    pub verdict: Verdict,
    /// Size of the cause that leaves least, in the unit of [`Cause`], and its standard deviation.
    pub size: (f64, f64),
    /// Leftover without a cause at the last decision.
    pub none: f64,
    /// What the best cause leaves at the last decision.
    pub least: f64,
    /// Number of decisions.
    pub rounds: u32,
    highest: f64,
}

#[derive(Clone, Debug, Default)]
struct Sums {
    ticks: u32,
    voltage: f64,
    model: f64,
    jumps: f64,
    residual: f64,
    readings: u32,
    identical: u32,
    lags: [f64; 3],
    tails: [f64; 2],
    slewed: [f64; 3],
    last_voltage: f64,
    last_model: f64,
    last_reading: f64,
}

#[derive(Clone, Debug, Default)]
struct Filters {
    nuisances: [f64; 3],
    time_constant: [f64; 3],
    creep: [f64; 2],
    leakage: [f64; 2],
    plays: [f64; 3],
    series: [f64; 3],
    end: f64,
    tails: [f64; 2],
    past: [f64; 8],
    springs: [f64; 16],
}

/// First-order low-pass; returns the mean of its values at both ends of the block.
fn low_pass(state: &mut f64, fraction: f64, input: f64) -> f64 {
    let before = *state;
    *state += fraction * (input - before);
    0.5 * (before + *state)
}

impl Bank {
    /// A bank at rest, for ticks of `rate_hz`.
    pub fn new(settings: Settings, rate_hz: f64) -> Self {
        let ticks = block_ticks(rate_hz);
        let block_s = f64::from(ticks) / rate_hz;
        let (sigma_v, correlation) = settings.block_noise(block_s);
        Self {
            settings,
            ticks,
            rate_hz,
            since_decision: 0,
            block_s,
            sigma_v,
            correlation,
            sums: Sums::default(),
            filters: Filters::default(),
            age: 0,
            last: ([0.0; VECTORS], 0.0),
            upward: [0.0; SMALLEST.len()],
            downward: [0.0; SMALLEST.len()],
            energy: 0.0,
            products: HYPOTHESES.iter().map(|h| vec![vec![0.0; h.vectors.len() + 1]; h.vectors.len() + 1]).collect(),
            released: (false, false),
            pinned_at: None,
            blocks: 0,
            alarmed: false,
            proposed: Verdict::Quiet,
            agreed: 0,
            against: 0,
            verdict: Verdict::Quiet,
            size: (0.0, 0.0),
            none: 0.0,
            least: 0.0,
            rounds: 0,
            highest: 0.0,
        }
    }

    /// Processes a tick: applied voltage, the model's stiffness and the reading of it, in V.
    pub fn tick(&mut self, voltage: f64, model: f64, reading: Option<f64>) {
        let sums = &mut self.sums;
        let change = voltage - sums.last_voltage;
        sums.last_voltage = voltage;
        sums.voltage += voltage;
        sums.model += model;
        if change.abs() > SMOOTH_V {
            sums.jumps += change * change.abs();
        }
        sums.last_model = model;
        let left = self.ticks - sums.ticks;
        for (tail, part) in sums.tails.iter_mut().zip([4, 2]) {
            *tail += if left <= self.ticks / part { model } else { 0.0 };
        }
        for (i, slewed) in sums.slewed.iter_mut().enumerate() {
            let rate = SLEW_RATES[i] * self.settings.range_v / self.settings.plant.time_constant_s;
            if sums.ticks % SLEW_TICKS != i as u32 {
                continue;
            }
            let reach = rate * self.block_s / f64::from(self.ticks) * f64::from(SLEW_TICKS);
            *slewed += (voltage - *slewed).clamp(-reach, reach);
            sums.lags[i] += (*slewed - voltage) * f64::from(SLEW_TICKS);
        }
        if let Some(reading) = reading {
            sums.residual += reading - model;
            sums.readings += 1;
            sums.identical += u32::from(reading == sums.last_reading);
            sums.last_reading = reading;
        }
        sums.ticks += 1;
        if sums.ticks == self.ticks {
            self.block();
        }
    }

    fn block(&mut self) {
        let sums = self.sums.clone();
        let Sums { slewed, last_voltage, last_model, last_reading, .. } = sums;
        self.sums = Sums { slewed, last_voltage, last_model, last_reading, ..Sums::default() };
        let ticks = f64::from(self.ticks);
        let expected = f64::from(self.settings.readings(self.block_s));
        let lags = sums.lags.map(|lag| lag / ticks);
        let vectors = self.signatures(
            sums.voltage / ticks,
            sums.model / ticks,
            &lags,
            &sums.tails.map(|tail| tail / ticks),
            sums.jumps,
        );
        if f64::from(sums.readings) < 0.75 * expected {
            self.age += 1;
            return;
        }
        let residual = sums.residual / f64::from(sums.readings);
        let mut pinned = sums.readings >= 4 && 4 * sums.identical >= 3 * sums.readings;
        if pinned {
            pinned = *self.pinned_at.get_or_insert(sums.last_reading) == sums.last_reading;
        }
        self.update(vectors, residual, pinned);
    }

    fn signatures(&mut self, u: f64, y: f64, lags: &[f64; 3], tails: &[f64; 2], jumps: f64) -> [f64; VECTORS] {
        let Self { settings, filters, block_s, .. } = self;
        let (share, tau, range, block_s) =
            (settings.plant.share, settings.plant.time_constant_s, settings.range_v, *block_s);
        let lag = |tau: f64| (-(-block_s / tau).exp_m1()).min(FASTEST);
        let (rest, fraction) = (1.0 - share, lag(tau));
        let w = (y - share * u) / rest;
        let mut v = [0.0; VECTORS];
        v[INITIAL..=SLOWER].copy_from_slice(&filters.nuisances);
        let slow = SLOW_TAUS.map(|times| lag(times * tau));
        for (nuisance, fraction) in filters.nuisances.iter_mut().zip([fraction, slow[0], slow[1]]) {
            *nuisance *= 1.0 - fraction;
        }
        v[GAIN] = y;
        v[SHARE] = u - w;
        let z = low_pass(&mut filters.time_constant[0], fraction, w - u);
        v[TAU] = rest * z;
        v[TAU_CURVED] = rest * (2.0 * low_pass(&mut filters.time_constant[1], fraction, z) - z);
        let part = u / range;
        v[TAU_VOLTAGE] = rest * low_pass(&mut filters.time_constant[2], fraction, part * (w - u));
        let creep: [f64; 2] = std::array::from_fn(|i| low_pass(&mut filters.creep[i], slow[i], u));
        v[CREEP] = creep[0] - w;
        v[CREEP_SLOWER] = creep[1] - creep[0];
        let leakage: [f64; 2] = std::array::from_fn(|i| low_pass(&mut filters.leakage[i], slow[i], y));
        v[LEAKAGE] = -leakage[0];
        v[LEAKAGE_SLOWER] = leakage[0] - leakage[1];
        let mut next = 0;
        let springs = &mut filters.springs;
        let mut respond = |input: f64| {
            next += 1;
            share * input + rest * low_pass(&mut springs[next - 1], fraction, input)
        };
        let mut plays = [0.0; 3];
        for (i, play) in filters.plays.iter_mut().enumerate() {
            let width = PLAYS[i] * range;
            *play = play.clamp(u - 0.5 * width, u + 0.5 * width);
            plays[i] = respond((*play - u) / PLAYS[i]);
        }
        v[PLAY] = plays[0];
        v[PLAY_SECOND] = plays[1];
        v[PLAY_WIDER] = plays[1] - plays[0];
        v[PLAY_WIDEST] = plays[2] - plays[1];
        v[LAW] = respond(range * 4.0 * part * (1.0 - part));
        v[LAW_CUBIC] = respond(range * 8.0 * part * (1.0 - part) * (part - 0.5));
        let hinge = LIMITS.map(|start| -range * (part - start).max(0.0) / (1.0 - start));
        v[LIMIT] = respond(hinge[0]);
        v[LIMIT_MIDDLE] = respond(hinge[1]) - v[LIMIT];
        v[LIMIT_TOP] = respond(hinge[2]) - v[LIMIT];
        v[SLEW] = respond(-0.5 * jumps / range);
        let slews: [f64; 3] = std::array::from_fn(|i| respond(lags[i]) * SLEW_RATES[i] * block_s / tau);
        v[SLEW_FIRST] = slews[0];
        v[SLEW_SECOND] = slews[1];
        v[SLEW_FASTER] = slews[0] - v[SLEW];
        v[SLEW_MIDDLE] = slews[1] - slews[0];
        v[SLEW_SLOWER] = slews[2] - slews[1];
        v[DELAY] = filters.end - self.sums.last_model;
        filters.end = self.sums.last_model;
        let whole = [1, 2, 4, 8].map(|blocks| (filters.past[blocks - 1] - y) / blocks as f64);
        let parts = [4.0 * (filters.tails[0] - tails[0]), 2.0 * (filters.tails[1] - tails[1])];
        filters.tails = *tails;
        filters.past.rotate_right(1);
        filters.past[0] = y;
        let late = [v[DELAY], parts[0], parts[1], whole[0], whole[1], whole[2], whole[3]];
        for i in 0..6 {
            v[DELAY + i] = late[i];
            v[DELAY_TO_QUARTER + i] = late[i + 1] - late[i];
        }
        let series: [f64; 3] = std::array::from_fn(|i| {
            let times = LAG_TAUS[i];
            (low_pass(&mut filters.series[i], lag(times * tau), y) - y) * block_s / (times * tau)
        });
        v[LAG] = series[0];
        v[LAG_SECOND] = series[1];
        v[LAG_SHORTER] = series[0] - v[DELAY];
        v[LAG_MIDDLE] = series[1] - series[0];
        v[LAG_LONGER] = series[2] - series[1];
        v[OFFSET] = 1.0;
        v[DRIFT] = y * f64::from(self.age.min(MOST_BLOCKS)) / f64::from(MOST_BLOCKS);
        v
    }

    fn update(&mut self, mut vectors: [f64; VECTORS], residual: f64, pinned: bool) {
        if pinned {
            vectors[PINNED] = residual;
            vectors[PINNED_BELOW] = residual.min(0.0);
        }
        self.age += 1;
        let scale = 1.0 / (self.sigma_v * (1.0 - self.correlation.powi(2)).sqrt());
        let whitened = |new: f64, old: f64| (new - self.correlation * old) * scale;
        let innovation = whitened(residual, self.last.1);
        let x: [f64; VECTORS] = std::array::from_fn(|i| whitened(vectors[i], self.last.0[i]));
        self.last = (vectors, residual);
        self.test(&x, innovation);
        if !self.alarmed && self.highest < thresholds::RESTART_NATS {
            self.restart();
            return;
        }
        if pinned && residual < -3.0 * self.sigma_v {
            self.released.0 = true;
        } else if !pinned && self.released.0 {
            self.released.1 = true;
        }
        for (products, hypothesis) in self.products.iter_mut().zip(HYPOTHESES) {
            let row: Vec<f64> = hypothesis.vectors.iter().map(|&i| x[i]).chain([innovation]).collect();
            for (i, a) in row.iter().enumerate() {
                for (j, b) in row.iter().enumerate() {
                    products[i][j] += a * b;
                }
            }
        }
        self.blocks += 1;
        if self.highest >= self.settings.alarm_nats {
            self.alarmed = true;
            if self.verdict == Verdict::Quiet {
                self.verdict = Verdict::Alarm;
            }
        }
        self.since_decision += 1;
        if self.alarmed && self.since_decision >= bank::ROUND {
            self.since_decision = 0;
            self.decide();
        }
        if self.blocks == MOST_BLOCKS {
            self.blocks /= 2;
            self.products.iter_mut().flatten().flatten().for_each(|sum| *sum *= 0.5);
        }
    }

    fn test(&mut self, x: &[f64; VECTORS], innovation: f64) {
        self.highest = 0.0;
        for (i, (vector, smallest)) in SMALLEST.into_iter().enumerate() {
            let shift = x[vector] * smallest;
            let (along, half) = (shift * innovation, 0.5 * shift * shift);
            let bounded = |nats: f64| nats.clamp(-20.0, thresholds::MOST_NATS);
            self.upward[i] = (self.upward[i] + bounded(along - half)).max(0.0);
            self.downward[i] = (self.downward[i] + bounded(-along - half)).max(0.0);
            self.highest = self.highest.max(self.upward[i]).max(self.downward[i]);
        }
        let gain = 0.375 * innovation * innovation - 2f64.ln();
        self.energy = (self.energy + gain.min(thresholds::MOST_NATS)).max(0.0);
        self.highest = self.highest.max(self.energy);
    }

    fn restart(&mut self) {
        self.products.iter_mut().flatten().flatten().for_each(|sum| *sum = 0.0);
        self.blocks = 0;
        self.since_decision = 0;
        self.age = 0;
        self.filters.nuisances = [256.0; 3];
        self.released = (false, false);
        self.pinned_at = None;
    }

    /// Restarts the sums as if a fault began with the present block, and lets them go on until the end.
    pub fn start(&mut self) {
        self.restart();
        self.alarmed = true;
    }

    /// True if the innovations since [`Bank::start`], taken as free of noise, exclude every cause but `cause` and those that contain it: by the
    /// naming rule each leaves so much that what the signature of `cause` leaves is no matter.
    pub fn excludes_others(&self, cause: Cause) -> bool {
        let bar = 2.0 * self.settings.margin_nats + self.unexplained() / f64::from(1 << thresholds::RIVAL_ERROR_BITS);
        let is_other = |other: Cause| other != cause && !NESTED.contains(&(cause, other));
        self.fits().into_iter().all(|(other, left, _)| !is_other(other) || left >= bar)
    }

    /// Returns what the nuisance alone leaves.
    fn unexplained(&self) -> f64 {
        // The hypothesis of a gain alone, without its last step.
        let gain = &self.products[0];
        gain[2][2] - if gain[0][0] > 0.0 { gain[0][2].powi(2) / gain[0][0] } else { 0.0 }
    }

    /// Returns what the best hypothesis of each cause leaves, and its size with its standard deviation.
    fn fits(&self) -> Vec<(Cause, f64, (f64, f64))> {
        let mut best: Vec<(Cause, f64, (f64, f64))> = Vec::new();
        for (products, hypothesis) in self.products.iter().zip(HYPOTHESES) {
            let (leftover, size, information) = fit(products);
            // What the fit leaves with the size at the nearer end of what is possible.
            let outside = size - size.clamp(hypothesis.lowest, hypothesis.highest);
            let leftover = leftover + outside * outside * information;
            let unit = self.settings.unit(hypothesis.cause, self.rate_hz);
            let size = (size * unit, unit * information.max(1e-300).sqrt().recip());
            match best.iter_mut().find(|(cause, ..)| *cause == hypothesis.cause) {
                Some(known) if leftover < known.1 => (known.1, known.2) = (leftover, size),
                Some(_) => {}
                None => best.push((hypothesis.cause, leftover, size)),
            }
        }
        best
    }

    fn decide(&mut self) {
        let n = f64::from(self.blocks);
        self.none = self.unexplained();
        let mut best = self.fits();
        best.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (cause, least, _) = best[0];
        self.rounds += 1;
        let total = (self.none - n).max(0.0);
        let tolerated =
            thresholds::NOISE_SIGMAS as f64 * (2.0 * n).sqrt() + total / f64::from(1 << thresholds::MODEL_ERROR_BITS);
        // A rival is excluded if it leaves more than its linear signature can be wrong by, and much more than the best.
        let excess =
            (total / f64::from(1 << thresholds::RIVAL_ERROR_BITS)).max(thresholds::RIVAL_RATIO as f64 * (least - n));
        let bar = least.max(n) + 2.0 * self.settings.margin_nats + excess;
        let rivals: Vec<Cause> = best[1..].iter().filter(|rival| rival.1 < bar).map(|rival| rival.0).collect();
        let among = self.among(cause, &rivals);
        let named = best.iter().find(|known| Some(known.0) == among.causes().0);
        self.least = named.map_or(least, |known| known.1);
        let says = if total < 2.0 * self.settings.margin_nats {
            Verdict::Alarm
        } else if named.is_none_or(|(_, left, _)| left - n > tolerated) {
            Verdict::Unknown
        } else {
            among
        };
        let same = |one: Verdict, other: Verdict| match (one, other) {
            (Verdict::Ambiguous(a, b), Verdict::Ambiguous(c, d)) => (a == c && b == d) || (a == d && b == c),
            _ => one == other,
        };
        self.agreed = if same(says, self.proposed) { self.agreed + 1 } else { 1 };
        self.against = if same(says, self.verdict) { 0 } else { self.against + 1 };
        if self.agreed >= u32::from(thresholds::AGREED) {
            self.verdict = says;
        } else if self.against >= u32::from(thresholds::AGREED) && matches!(self.verdict, Verdict::Named(_)) {
            self.verdict = Verdict::Alarm;
        }
        self.proposed = says;
        if let Some(cause) = self.verdict.causes().0 {
            self.size = best.iter().find(|known| known.0 == cause).map_or((0.0, 0.0), |known| known.2);
        }
    }

    /// The verdict when `cause` leaves least and `rivals` cannot be excluded.
    fn among(&self, cause: Cause, rivals: &[Cause]) -> Verdict {
        let mut left: Vec<Cause> = std::iter::once(cause).chain(rivals.iter().copied()).collect();
        for (inner, outer) in NESTED {
            let certain = inner != Cause::SensorSaturation || self.released.1;
            if certain && left.contains(&inner) {
                left.retain(|cause| *cause != outer);
            }
        }
        match left[..] {
            [cause] => Verdict::Named(cause),
            [cause, rival, ..] => Verdict::Ambiguous(cause, rival),
            [] => Verdict::Unknown,
        }
    }
}

/// Leftover of a least-squares fit by elimination, coefficient and information of its last vector.
fn fit(products: &[Vec<f64>]) -> (f64, f64, f64) {
    let mut m = products.to_vec();
    let last = m.len() - 1;
    let (mut size, mut information) = (0.0, 0.0);
    for k in 0..last {
        if m[k][k] * f64::from(1 << thresholds::DEPENDENT_BITS) <= products[k][k] {
            continue;
        }
        if k + 1 == last {
            (size, information) = (m[k][last] / m[k][k], m[k][k]);
        }
        let pivot = m[k].clone();
        for row in &mut m[k + 1..] {
            let factor = row[k] / pivot[k];
            row.iter_mut().zip(&pivot).for_each(|(element, above)| *element -= factor * above);
        }
    }
    (m[last][last].max(0.0), size, information)
}
