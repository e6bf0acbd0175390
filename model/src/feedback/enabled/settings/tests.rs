use super::*;

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn the_gain_is_that_of_the_steady_kalman_filter() {
    // The steady filter, by iterating the prediction and update of its variance.
    for (noise_v, model_uncertainty, interval_s) in [(1.0, 1.0, 1e-3), (0.2, 3.0, 1e-2), (20.0, 0.1, 1e-4)] {
        let feedback = Feedback { noise_v, model_uncertainty, interval_s, fastest_s: 0.0, ..Feedback::TYPICAL };
        let (mut variance, mut gain) = (1.0, 0.0);
        for _ in 0..10_000_000 {
            let predicted: f64 = variance + model_uncertainty * model_uncertainty * interval_s;
            let next = predicted / (predicted + noise_v * noise_v);
            variance = (1.0 - next) * predicted;
            if f64::abs(next - gain) < 1e-15 {
                break;
            }
            gain = next;
        }
        assert!((feedback.gain() - gain.min(0.499)).abs() < 1e-6, "{} {gain}", feedback.gain());
    }
    let unbounded = Feedback { fastest_s: 0.0, ..Feedback::TYPICAL };
    assert_eq!(Feedback { fastest_s: -0.0, ..unbounded }.gain(), unbounded.gain());
    // Bounded by `fastest_s`.
    let bounded = Feedback { noise_v: 0.01, fastest_s: 0.5, ..Feedback::TYPICAL };
    assert!((bounded.gain() - (1.0 - (-0.002f64).exp())).abs() < 1e-12);
}

#[test]
fn a_setting_out_of_range_is_rejected_by_name() {
    let time = SampleTime::from_rate(1000.0).unwrap();
    let good = Feedback::TYPICAL;
    assert_eq!(good.check(time), Ok(()));
    for (field, wrong) in [
        ("noise_v", Feedback { noise_v: 0.0, ..good }),
        ("noise_v", Feedback { noise_v: f64::NAN, ..good }),
        ("model_uncertainty", Feedback { model_uncertainty: -1.0, ..good }),
        ("fastest_s", Feedback { fastest_s: f64::INFINITY, ..good }),
        ("interval_s", Feedback { interval_s: 1e-4, ..good }),
        ("interval_s", Feedback { interval_s: 1.0, ..good }),
        ("oldest_s", Feedback { oldest_s: 0.04, ..good }),
        ("lowest_v", Feedback { lowest_v: -1001.0, ..good }),
        ("highest_v", Feedback { highest_v: -60.0, ..good }),
        ("fade_s", Feedback { fade_s: 0.0, ..good }),
    ] {
        assert_eq!(wrong.check(time).unwrap_err().field, field, "{wrong:?}");
    }
}

#[test]
fn each_bound_is_where_it_is_documented() {
    let time = SampleTime::from_rate(1000.0).unwrap();
    let good = Feedback::TYPICAL;
    let error = |feedback: Feedback| feedback.check(time).map_err(|error| error.field);
    // Up to 31 sample times, the length of the history less the present one.
    assert_eq!(error(Feedback { oldest_s: 0.031, ..good }), Ok(()));
    assert_eq!(error(Feedback { oldest_s: 0.0311, ..good }), Err("oldest_s"));
    assert_eq!(error(Feedback { lowest_v: 500.0, highest_v: 501.0, ..good }), Ok(()));
    assert_eq!(error(Feedback { lowest_v: 500.0, highest_v: 500.9, ..good }), Err("highest_v"));
    assert_eq!(error(Feedback { highest_v: 1000.1, ..good }), Err("highest_v"));
    assert_eq!(error(Feedback { fade_s: 0.002, ..good }), Ok(()));
    assert_eq!(error(Feedback { fade_s: 0.0019, ..good }), Err("fade_s"));
    assert_eq!(error(Feedback { interval_s: 0.001, ..good }), Ok(()));
    assert_eq!(error(Feedback { interval_s: 0.1, ..good }), Ok(()));
    assert_eq!(error(Feedback { interval_s: 0.000_99, ..good }), Err("interval_s"));
}

#[test]
fn values_are_in_the_order_of_the_fields() {
    let values = [0.5, 2.0, 0.2, 0.002, 0.02, -10.0, 500.0, 3.0];
    let feedback = Feedback::from_values(values).unwrap();
    assert_eq!(feedback.values(), values);
    assert_eq!((feedback.noise_v, feedback.oldest_s, feedback.fade_s), (0.5, 0.02, 3.0));
}

#[test]
fn a_fresh_reading_has_no_age() {
    let stiffness = ScaledStiffness(crate::units::Signal::from_num(3));
    assert_eq!(Reading::fresh(stiffness), Some(Reading { stiffness, age: 0 }));
}
