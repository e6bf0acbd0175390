//! The empirical thresholds, in the order of the folders that use them.

use super::Threshold;

macro_rules! thresholds {
    ($($(#[doc = $decision:literal])+ $name:ident = $value:literal, $unit:literal $(, set by $command:literal)?;)+) => {
        #[allow(clippy::upper_case_acronyms, non_camel_case_types, reason = "numbers the constants in their order")]
        enum Index { $($name),+ }

        $(
            $(#[doc = $decision])+
            pub const $name: Threshold = Threshold {
                index: Index::$name as usize,
                name: stringify!($name),
                value: $value,
                unit: $unit,
                decision: concat!($($decision),+),
                set_by: concat!("" $(, $command)?),
            };
        )+

        /// All empirical thresholds.
        pub const ALL: &[Threshold] = &[$($name),+];
    };
}

thresholds! {
    // stats
    /// Smallest scale of noise that is assumed: the resolution of the fixed-point tick, 2e-5 of the reference voltage. A noise-free
    /// record of another simulation differs from this one by the time steps of both.
    FINEST_V = 0.01, "normalised volts (500 are the reference voltage)";

    // record
    /// Fewer readings before the first voltage cannot show a decay of the spring.
    FEWEST_ROWS_AT_REST = 4.0, "readings";
    /// Fewer readings before the first voltage cannot show that a spring of unknown time constant is at rest.
    FEWEST_ROWS_OF_REST = 10.0, "readings";
    /// A shorter rest before the first voltage cannot show a decay of the spring.
    SHORT_REST = 0.3, "time constants";
    /// A decay before the first voltage with a larger amplitude shows that the spring was not at rest; the noise's
    /// autocorrelation is only estimated.
    SIGNIFICANT_DECAY = 5.0, "standard deviations";
    /// Largest lag-1 correlation of the noise that is assumed when a decay is tested.
    LARGEST_CORRELATION = 0.98, "correlation";
    /// Records with fewer rows are held out stair by stair, if they have enough stairs.
    FEW_ROWS = 200.0, "rows";
    /// Fewest stairs of a short record that is held out stair by stair.
    FEWEST_STAIRS = 4.0, "stairs";
    /// Length of the shortest held-out segment.
    SHORTEST_SEGMENT = 3.0, "rows";
    /// A step of the readings that is finer is attributed to their printed digits and not to a converter.
    FEWEST_UNITS = 4.0, "units of the last digit";
    /// Fewest rows in each of ten groups of equal level from which growth of the noise with the level is estimated.
    FEWEST_ROWS_OF_LEVEL = 20.0, "rows";
    /// Growth of the noise with the level is significant if its slope is larger; the standard error is approximate.
    SIGNIFICANT_SLOPE = 6.0, "standard errors";
    /// Growth of the noise is taken into account if its scale at the highest level is larger than this.
    RELEVANT_RATIO = 1.3, "of the scale at the lowest level";
    /// Fewest equal readings at an extreme that are taken for a bound of the sensor.
    FEWEST_TIES = 3.0, "readings";
    /// Readings at a bound must outnumber those at the next step of a quantisation grid, or any other repeated reading, by this factor.
    BOUND_TO_NEXT_STEP = 6.0, "of the readings at the next step";
    /// A reading that is further from an extreme is not a neighbour of it: isolated error codes are not a bound.
    CLOSE_TO_BOUND = 30.0, "scales of the noise";
    /// Larger steps of the readings are treated as quantisation cells, smaller ones as noise.
    COARSE = 2.0, "scales of the noise";
    /// Truncation instead of rounding is considered from this size of a step.
    LEAST_TRUNCATION = 0.5, "scales of the noise";
    /// Smallest part of the readings that repeat the one before, from which they are examined for having been held.
    LEAST_HELD = 0.05, "of the readings";
    /// Part of the readings that repeat the one before, beside which no longer run is that of a stuck sensor.
    MOST_REPEATED = 0.15, "of the readings";
    /// Readings of which more return to the one before last are on a grid, and not held.
    MOST_RETURNS = 0.02, "of the new readings";
    /// Readings on a grid with a larger step repeat because of it, and are not held.
    COARSEST_GRID_OF_HELD = 0.05, "of the median change";
    /// A spectral line with fewer periods in the record may be a harmonic of the schedule that a nonlinear spring makes.
    FEWEST_PERIODS = 10.0, "periods";
    /// Records with fewer rows have no spectral lines.
    FEWEST_ROWS_FOR_LINES = 16.0, "rows";

    // plant
    /// Larger errors are weighted down when the initial state is estimated (Huber's threshold).
    HUBER_THRESHOLD = 3.0, "scales of the noise";

    // noise
    /// In records with fewer rows autocorrelation cannot be distinguished from structure.
    FEWEST_ROWS_FOR_AUTOCORRELATION = 24.0, "rows";
    /// In records with fewer rows a fractional difference is not tried.
    FEWEST_ROWS_FOR_DIFFERENCE = 150.0, "rows";
    /// Fewest rows of the record for each lag of the autoregression.
    ROWS_PER_LAG = 12.0, "rows";
    /// Errors are clipped here before their autocorrelation is estimated, or that of the record's halves is compared.
    CLIP_FOR_AUTOCORRELATION = 4.0, "scales of the noise";
    /// Gain by which a fractional difference must exceed an autoregression alone; unexplained structure has a similar spectrum.
    COST_OF_DIFFERENCE = 8.0, "nats";
    /// Gain by which a heavy tail must exceed normal noise.
    COST_OF_HEAVY_TAIL = 2.0, "nats";
    /// Gain by which a mixture of two normal distributions must exceed one heavy tail to count as outliers.
    COST_OF_OUTLIERS = 7.0, "nats";
    /// Fewest rows in which a mixture is tried.
    FEWEST_ROWS_FOR_OUTLIERS = 30.0, "rows";
    /// A mixture with a larger fraction of the wider distribution is not taken for outliers.
    MOST_OUTLIERS = 0.25, "of the rows";
    /// Smallest scale of outliers.
    LEAST_OUTLIER_SCALE = 4.0, "scales of the noise";

    // effects
    /// Smallest time constant of a lag in series; a shorter one looks like a delay of less than a row.
    FASTEST_SERIES_LAG = 0.3, "row spacings";
    /// Smallest damping ratio of a resonance; an oscillation that a polymer damps less is a periodicity of the schedule.
    LEAST_DAMPED = 0.005, "damping ratio";
    /// Largest damping ratio of a resonance; with an overshoot below a sixth, an oscillation cannot be distinguished from a lag.
    MOST_DAMPED = 0.5, "damping ratio", set by "cargo campaign out-of-model";
    /// Smallest part of the readings' sum of squares before a step of the gain, and after it: with less before, it is a gain error.
    LEAST_PART_OF_STEP = 0.1, "of the sum of squares";
    /// Shortest run of shifted readings that is a reading offset, and of equal ones that is a stuck sensor.
    SHORTEST_RUN = 5.0, "rows";
    /// Price of the places of a run of shifted readings; neighbouring runs are nearly equivalent.
    PRICE_OF_RUN = 1.25, "nats for each unit of ln(rows)";
    /// Smallest part of what the errors have beyond noise that a shift which decays, or comes and goes by ramps, has to explain; a curve of
    /// another cause is explained in part.
    MOST_OF_STRUCTURE = 0.7, "of the sum of squares beyond noise";
    /// Errors are clipped here when the run of shifted readings is searched.
    CLIP_FOR_RUN = 6.0, "scales of the noise";
    /// Autocorrelation of errors from which they are whitened when the run is searched.
    WHITENED_FROM = 0.5, "correlation of neighbouring rows";
    /// Number of first rows from which the sensor's zero is estimated.
    ROWS_FOR_ZERO = 10.0, "rows";
    /// Smallest time constant of a charge leakage; a faster loss hardly lets the stiffness fall and looks like a gain.
    FASTEST_LEAKAGE = 0.636_363_636_363_636_4, "reference time constants";
    /// Smallest time constant of a second relaxation: the reference time constant.
    FASTEST_CREEP = 1.0, "reference time constants";

    // fit
    /// The autocorrelation is strong if it predicts so much that the errors exceed the innovations by this factor.
    STRONG_AUTOCORRELATION = 4.0, "scales of the innovations";
    /// A coordinate is unknown outside of a fold if the other rows hold less of its information.
    LEAST_INFORMATION = 0.01, "of the coordinate's information";

    // adequacy
    /// Smallest squared correlation of the readings with the voltage or the simulation that is a response.
    RESPONSE = 0.25, "squared correlation";
    /// Fewest rows in each of the parts or stretches of a record whose means are tested.
    ROWS_PER_MEAN = 5.0, "rows";
    /// An error in step with the spring counts from this ratio of its root mean square to its scatter within the parts.
    ERROR_PER_SCATTER = 2.0, "of the scatter";
    /// If the simulation's range is larger, constant readings are a fault of the sensor and not a lack of excitation.
    RANGE_OF_A_DEAD_SENSOR = 0.01, "reference voltages";
    /// Fewest rows for each feature of the residual's regression.
    ROWS_PER_FEATURE = 10.0, "rows";
    /// Whitened residuals are clipped here before their spectrum is taken.
    SPECTRUM_CLIP_SCALES = 6.0, "scales of the noise";
    /// A spring with a smaller robust error follows the voltage, however likely autocorrelated noise makes a constant.
    SPRING_ERROR_PER_SCATTER = 0.9, "of the readings' robust scatter around the constant";
    /// A range of voltages is named in addition to the stretch of time if it holds more of the error, and the error is denser there.
    POWER_TO_NAME_VOLTAGES = 0.5, "of the error's power";
    /// A reading with a larger innovation is far off.
    FAR_OFF_SCALES = 4.0, "scales of the noise";
    /// A smaller change of the voltage is not one that spikes may follow.
    CHANGE_OF_FULL_SCALE = 0.01, "of the full scale", set by "cargo campaign out-of-model";
    /// Readings up to here after a change of the voltage, as it leaves the amplifier, are just after it.
    ROWS_AFTER_CHANGE = 4.0, "rows", set by "cargo campaign out-of-model";
    /// Spikes follow the voltage if more of the far readings are just after a change.
    SHARE_AFTER_CHANGES = 0.5, "of the far readings", set by "cargo campaign out-of-model";
    /// Far readings come in runs if more of them are next to another of equal sign.
    SHARE_IN_RUNS = 0.2, "of the far readings";
    /// Fewest blocks of rows whose means are regressed on earlier voltages.
    FEWEST_BLOCKS = 200.0, "blocks";
    /// Largest difference between the two finest octaves of white noise.
    COLOUR_OF_WHITE = 4.0, "standard errors";
    /// A voltage that changes less from one period to the next is periodic.
    REPEATED_VOLTAGE = 0.01, "of its variance";
    /// Fewest rows in each of the eight parts whose means are compared with the error's scale.
    ROWS_PER_SWING = 10.0, "rows";
    /// An error with more of its mean square in the parts' means is not stationary noise.
    SLOW_SHARE = 0.75, "of the mean square";
    /// An error whose autocorrelation changes more between the halves of the record is not stationary noise.
    CHANGE_NATS = 60.0, "nats";
    /// The same limit for long records; the larger of the two applies.
    CHANGE_NATS_PER_ROW = 0.02, "nats per row";
    /// A spectral line above this is not part of the autocorrelated noise.
    LINE_TO_NEIGHBOURS = 30.0, "of the mean power of its neighbours";

    // search
    /// Price of a block without its places and forms: roughly the gain of the best of all blocks on noise.
    PRICE_OF_BLOCK = 4.3, "nats", set by "cargo campaign nulls";
    /// Price of each fitted coordinate of a block beyond what held-out rows charge, so that a block with more coordinates does not
    /// replace one with fewer.
    PRICE_OF_COORDINATE = 1.8, "nats";
    /// Assumed difference in form between the spring and a block.
    MISFIT_OF_FORM = 0.005, "of what the block changes", set by "cargo campaign long";
    /// Largest misfit of form; a larger one would show as autocorrelation.
    MISFIT_PER_FLOOR = 0.3, "of the noise floor", set by "cargo campaign long";
    /// Factor on the misfit of form for a second block in the same stage of the chain: it may correct the form of the first rather
    /// than be another cause.
    SAME_STAGE = 15.0, "misfits of form", set by "cargo campaign out-of-model";
    /// Predicted gain that one form of an effect must exceed for the effect to be fitted.
    NATS_TO_FIT = 2.5, "nats";
    /// Predicted gain that a block must exceed when the search is not exhaustive.
    GAIN_PER_PRICE = 0.5, "of its price";
    /// Largest loss of score of a first fit against the structure that it extends, at which it is still evaluated; no limit while
    /// the search is exhaustive.
    NATS_TO_LOSE_AT_FIRST = 10.0, "nats";
    /// Gain in log-likelihood of a new first fit over an evaluated one from which the structure is evaluated again.
    NATS_TO_EVALUATE_AGAIN = 1.0, "nats";
    /// Largest loss of score at which a structure may stay in the beam while the noise is autocorrelated.
    NATS_TO_LOSE_IN_BEAM = 30.0, "nats";

    // verdict
    /// A smaller change of the voltage is not a reversal.
    REVERSAL_OF_FULL_SCALE = 0.02, "of the full scale";
    /// A structure with a larger root mean square error is rejected: likelier readings with a larger error are no improvement.
    LARGEST_ERROR_RATIO = 1.005, "of the error of the simulation as it is given";
    /// A smaller step of the readings is not reported.
    STEP_TO_REPORT = 0.5, "root mean square errors";
    /// The verdict is `unexplained` if unmodelled dynamics are more of the residual.
    SHARE_UNEXPLAINED = 0.1, "of the residual's mean square";
    /// The verdict is `unexplained` if the held-out error is this many times that of the best linear model.
    WORSE_THAN_LINEAR = 1.05, "errors of the linear model";
    /// The verdict is `unexplained` if the last 40 % of the record are predicted with this many times the error without a cause.
    WORSE_THAN_WITHOUT = 1.05, "errors without the cause";
    /// Mean square error that a law of unknown form may leave for a further cause.
    UNKNOWN_FORM = 0.01, "of the mean square that the largest other cause removes", set by "cargo campaign out-of-model";
    /// Rows of a record in which a wrong form that removes as much of an unknown law as is left leaves structure that shows; of fewer
    /// rows it removes more unseen, in inverse proportion.
    ROWS_THAT_DETECT = 2000.0, "rows", set by "cargo campaign reliability";
    /// Mean square error that an unknown law may remove from the rest.
    UNKNOWN_NOISE = 0.1, "of the mean square that is left", set by "cargo campaign out-of-model";
    /// Largest probability of a cause in a record with the verdict `unexplained`.
    IF_UNEXPLAINED = 0.9, "probability", set by "cargo campaign out-of-model";
    /// Largest probability of linear dynamics beside a nominal spring that was identified from the same readings.
    IF_IDENTIFIED = 0.05, "probability", set by "cargo campaign identified";
    /// Largest probability of a cause with which the last 40 % of the record are predicted worse than without it.
    IF_SPOILING = 0.5, "probability";
    /// Readings at a bound have saturated if the stiffness exceeds the bound by more in the mean.
    STEPS_BEYOND_BOUND = 0.5, "steps of the readings";
    /// A record is insufficient if an error of the gain as large as this could have been missed.
    WIDEST_GAIN_MARGIN = 0.5, "of the nominal gain";
    /// A record is insufficient if an error of the time constant as large as this could have been missed.
    WIDEST_TIME_CONSTANT_MARGIN = 1.0, "of the nominal time constant";

    // examine
    /// Fewest readings that are diagnosed.
    ROWS_TO_DIAGNOSE = 8.0, "readings";
    /// In a record with more rows a part of them is searched first.
    LONG_RECORD_ROWS = 5000.0, "rows", set by "cargo campaign speed";
    /// Approximate number of rows in that part.
    ROWS_TO_SEARCH = 2500.0, "rows", set by "cargo campaign speed";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_threshold_has_its_own_name_and_is_at_its_index() {
        for (index, threshold) in ALL.iter().enumerate() {
            assert_eq!(threshold.index, index);
            assert!(ALL[..index].iter().all(|other| other.name != threshold.name), "{}", threshold.name);
            assert!(threshold.value > 0.0 && threshold.decision.trim_end().ends_with('.'), "{}", threshold.name);
        }
    }

    #[cfg(feature = "sensitivity")]
    #[test]
    fn one_threshold_varies_and_the_others_keep_their_values() {
        super::super::vary(Some((STEPS_BEYOND_BOUND, 2.0)));
        assert_eq!((STEPS_BEYOND_BOUND.get(), STEP_TO_REPORT.get()), (1.0, 0.5));
        super::super::vary(None);
        assert_eq!(STEPS_BEYOND_BOUND.get(), 0.5);
    }
}
