//! The share of an exported plant: a controller cannot run a negative one.

use identify::{Options, examine};
use random_numbers::Lcg32;
use simulation::record::{Record, Row};

/// A record of random steps of 0 to 500 V of a spring with the report's time constant and this share; uniform noise of +-1 V times `sign`.
fn record(share: f64, sign: f64) -> Record {
    let mut random = Lcg32::new(5);
    let (mut lag_v, mut voltage_v) = (0.0, 0.0);
    let mut row = |index: usize| {
        if index % 40 == 5 {
            voltage_v = 500.0 * random.uniform();
        }
        let noise_v = sign * (2.0 * random.uniform() - 1.0);
        let measured = Some(share * voltage_v + (1.0 - share) * lag_v + noise_v);
        lag_v += (voltage_v - lag_v) * -f64::exp_m1(-0.1 / 5.5);
        Row { line: index + 2, time_s: 0.1 * index as f64, voltage_v, measured }
    };
    Record { name: "steps".into(), rows: (0..1200).map(&mut row).collect() }
}

/// Of the noise and its negative, one makes the share negative by what is within its interval.
#[test]
fn a_negative_share_whose_interval_contains_0_is_exported_as_0_and_any_other_stays() {
    let shares = |share: f64, sign: f64| {
        let diagnosis = examine(&record(share, sign), &Options::default(), |_| ()).unwrap();
        let finding = &diagnosis.report.findings[0];
        assert_eq!(finding.cause, "instantaneous-share");
        let tick_refuses = diagnosis.report.extended.tick_refuses.is_some();
        (finding.parameters[0].1.value, diagnosis.plant.relaxation.share, tick_refuses)
    };
    let both = [shares(0.0, 1.0), shares(0.0, -1.0)];
    assert_eq!(both.iter().filter(|(found, ..)| *found < 0.0).count(), 1, "{both:?}");
    for (found, written, tick_refuses) in both {
        assert!(found.abs() < 0.002 && written == found.max(0.0) && !tick_refuses, "{both:?}");
    }
    let (found, written, tick_refuses) = shares(-0.1, 1.0);
    assert!((found + 0.1).abs() < 0.002 && written == found && tick_refuses, "{found} {written}");
}
