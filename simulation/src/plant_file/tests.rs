use crate::plant_file::*;

/// A file with every table and field.
const WHOLE: &str = include_str!("../../../docs/plant.toml");

#[test]
fn values_of_a_file_are_read() {
    let file = parse("p", "schema = 1\n[relaxation]\nshare = 0.2\ntau_s = 3\n").unwrap();
    assert_eq!(file.extended().plain(), Some(Plant { share: 0.2, time_constant_s: 3.0 }));
    assert_eq!(file, Plant { share: 0.2, time_constant_s: 3.0 }.into());
    let whole = parse("p", WHOLE).unwrap();
    assert_eq!(whole.extended().plain(), None);
    assert_eq!(whole.left_out(), ["amplifier.delay_s", "drift", "remarks"]);
    let plant = whole.extended();
    assert_eq!(plant.memory.unwrap().thresholds_v, [10.0, 25.0]);
    assert_eq!(plant.law.unwrap().stiffness[4], 410.0);
    assert_eq!(plant.relaxation.lags().collect::<Vec<_>>(), [(5.5, 0.8), (40.0, 0.109)]);
}

#[test]
fn load_plain_accepts_the_plain_spring_only() {
    assert_eq!(load_plain("paper").unwrap(), Plant::PAPER);
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/plant.toml");
    assert!(load_plain(example).unwrap_err().to_string().contains("expected [relaxation] with one share and tau_s"));
    assert!(load(example).is_ok());
}

#[test]
fn a_written_file_reads_back_unchanged() {
    let whole = parse("p", WHOLE).unwrap();
    let mut slim = whole.clone();
    (slim.memory, slim.law, slim.leakage, slim.unmodelled) = (None, None, None, None);
    slim.relaxation.tau_s = vec![1.0 / 3.0];
    slim.relaxation.tau_high_s = Some(0.7);
    slim.relaxation.weights.clear();
    slim.amplifier = Some(Amplifier { slew_v_per_s: Some(0.1 + 0.2 + 1.0), ..Amplifier::default() });
    let paper = PlantFile::from(Plant::PAPER);
    for file in [whole, slim, paper] {
        let text = file.to_toml().unwrap();
        assert_eq!(parse("p", &text).unwrap(), file, "{text}");
    }
}

#[test]
fn errors_are_one_line_with_their_place() {
    let plain = "schema = 1\n[relaxation]\nshare = 0.2\ntau_s = 3.0\n";
    let changed = |from: &str, to: &str| WHOLE.replace(from, to);
    for (text, expected) in [
        ("schema = 1\n[relaxation]\nshare = \"much\"\ntau_s = 3.0\n".into(), "p, line 3, column 9:"),
        ("schema = 1\n[relaxation]\nshare = 0.2\n".into(), "missing field `tau_s`"),
        (format!("{plain}ta = 1.0\n"), "p, line 5, column 1: unknown field `ta`"),
        (format!("{plain}[hysteresis]\nwidth = 1\n"), "p, line 5, column 2: unknown field `hysteresis`"),
        (plain.replace("schema = 1", "schema = 2"), "p, line 1, column 10: schema = 2 is not allowed: expected 1 as"),
        (plain.replace("0.2", "-1.0"), "p, line 3, column 9: share = -1 is not allowed: expected 0 to 0.9"),
        (plain.replace("3.0", "nan"), "p, line 4, column 9: tau_s = NaN"),
        (
            format!("{plain}[reading]\ngain = 0\n"),
            "p, line 6, column 8: gain = 0 is not allowed: expected 2.2250738585072014e-308 to 1.7976931348623157e308 per V, or",
        ),
        (format!("{plain}[reading]\ngain = 1\nzero = inf\n"), "p, line 7, column 8: zero = inf is not allowed"),
        (plain.replace("3.0", "\"slow\""), "p, line 4, column 9: invalid type: string \"slow\", expected a number or"),
        ("schema = ".into(), "p, line 1"),
        (changed("[10.0, 25.0]", "[10.0, 2500]"), "p, line 15, column 23: thresholds_v = 2500 is not allowed"),
        (changed("[10.0, 25.0]", "[10.0]"), "p, line 16, column 11: weights = 2 is not allowed: expected 1 weights"),
        (changed("[0, 100, 200", "[0, 300, 200"), "p, line 19, column 22: voltage_v = 200 is not allowed"),
        (
            changed("[0, 100, 200", "[5, 100, 200"),
            "p, line 19, column 14: voltage_v = 5 is not allowed: expected 0 V, where the law starts",
        ),
        (
            changed("[0, 90", "[0, 9000"),
            "p, line 20, column 17: stiffness = 9000 is not allowed: expected -1000 to 1000",
        ),
        (changed("share = 0.1\n", "share = 1.5\n"), "p, line 23, column 9: share = 1.5 is not allowed"),
        (changed("weights = [0.8, 0.109]\n", ""), "weights = 0 is not allowed: expected 2 weights"),
        (changed("tau_high_s = 8.0", "tau_high_s = 80"), "p, line 30, column 14: tau_high_s = 80 is not allowed"),
        (changed("650.0", "4"), "p, line 34, column 11: limit_v = 4 is not allowed: expected 10 to 1000 V"),
        (changed("limit_v = 650.0", "limit = 650.0"), "p, line 34, column 1: unknown field `limit`"),
    ] {
        let got = parse("p", &text).unwrap_err().to_string();
        assert!(got.contains(expected) && !got.contains('\n'), "{text:?}: {got}");
    }
}

#[test]
fn a_host_accepts_springs_beyond_the_ranges_of_the_tick() {
    let path = std::env::temp_dir().join(format!("plant-for-host-{}.toml", std::process::id()));
    let load = |text: &str| {
        std::fs::write(&path, text).unwrap();
        let name = path.display().to_string();
        (super::load(&name).map_err(|error| error.to_string()), load_for_host(&name).map_err(|error| error.to_string()))
    };
    let quick =
        "schema = 1\neven = true\n[reading]\ngain = -0.05\nzero = 20.5\n[relaxation]\nshare = 1\ntau_s = 1e-6\n";
    let (tick, host) = load(quick);
    assert!(tick.unwrap_err().contains("share = 1 is not allowed"));
    assert_eq!(host.unwrap().reading, Some(Reading { gain: -0.05, zero: 20.5 }));
    for (from, to, expected) in [
        ("1e-6", "-1", "line 8, column 9: tau_s = -1 is not allowed"),
        ("share = 1", "share = nan", "share = NaN is not allowed"),
        ("-0.05", "0", "line 4, column 8: gain = 0 is not allowed"),
        ("zero = 20.5", "zero = nan", "zero = NaN"),
        ("[reading]", "[units]\ntime = \"fortnight\"\n[reading]", "`fortnight` is not a unit of time"),
        ("[relaxation]", "[law]\nvoltage_v = [0, 2, 1]\nstiffness = [0, 1, 2]\n[relaxation]", "voltage_v = 1 is not"),
    ] {
        let error = load(&quick.replace(from, to)).1.unwrap_err();
        assert!(error.contains(expected) && !error.contains('\n'), "{error}");
    }
    std::fs::remove_file(path).unwrap();
}

#[test]
fn a_time_constant_at_another_voltage_is_converted_for_the_tick() {
    let changed = WHOLE.replace("tau_high_at_v = 500.0", "tau_high_at_v = 250.0").replace("= 8.0", "= 6.5");
    assert_eq!(parse("p", &changed).unwrap().extended().relaxation.time_constant_high_s, Some(7.5));
}

#[test]
fn effects_not_simulated_are_named_without_control_characters() {
    let text = "schema = 1\n[relaxation]\nshare = 0.1\ntau_s = 5.5\n[unmodelled]\ndrift = 1\n\"a\\nb\\u0000\" = 1\n";
    assert_eq!(parse("t", text).unwrap().left_out(), [r"a\nb\0", "drift"]);
}

/// The tick has no oscillation, so a spring that is mostly one is refused for that and not for what follows from it.
#[test]
fn an_oscillation_that_carries_the_response_is_refused_by_the_tick() {
    let plain = "schema = 1\n[relaxation]\nshare = 0.0003\ntau_s = 0.03\n[[mode]]\nfreq_hz = 6\nzeta = 0.1\nweight = ";
    for (weights, of_response) in [(vec![0.9997], 0.9997), (vec![0.02, -0.02], 0.04)] {
        let second =
            weights.get(1).map_or(String::new(), |w| format!("[[mode]]\nfreq_hz = 9\nzeta = 0.1\nweight = {w}\n"));
        let text = format!("{plain}{}\n{second}", weights[0]);
        let expected = format!(
            "p, line 5, column 1: mode = {of_response} is not allowed: expected 0 to 0.03 of the settled response, because the tick \
             takes oscillations as instantaneous"
        );
        assert_eq!(parse("p", &text).unwrap_err().to_string(), expected);
        assert!(parse_for_host("p", &text).is_ok());
    }
    let small = parse("p", &format!("{plain}0.02\n")).unwrap();
    assert_eq!(small.left_out(), ["mode"]);
    // What the tick refuses is a sum that is not in the file.
    let error = parse("p", &format!("{plain}0.02\n").replace("0.0003", "0.89")).unwrap_err().to_string();
    assert!(error.starts_with("p, line 3, column 9: share = 0.91 is not allowed: expected 0 to 0.9"), "{error}");
    assert!(error.ends_with("together with the weight of [[mode]]"), "{error}");
}

#[test]
fn a_message_shows_the_unit_of_the_command() {
    let bar = "schema = 1\n[units]\nvoltage = \"bar\"\n[relaxation]\nshare = 0.1\ntau_s = 1\n[amplifier]\n";
    for (field, expected) in [("limit_v", "10 to 1000 bar"), ("slew_v_per_s", "1 to 1000000000 bar/s")] {
        let error = parse("p", &format!("{bar}{field} = 0.5\n")).unwrap_err().to_string();
        assert!(error.contains("line 8, column ") && error.ends_with(expected), "{error}");
    }
    let law = bar.replace("[relaxation]", "[law]\nvoltage_v = [5, 10]\nstiffness = [0, 10]\n[relaxation]");
    assert!(parse("p", &law).unwrap_err().to_string().ends_with("expected 0 bar, where the law starts"));
    // A number of the file is in V where the command is in kV.
    let error = parse("p", &format!("{}limit_v = 0.5\n", bar.replace("bar", "kV"))).unwrap_err().to_string();
    assert!(error.ends_with("expected 10 to 1000 V"), "{error}");
}

/// The law of an electrostatic spring as an identification writes it: 33 points of `v^2 / 500 V`.
#[test]
fn a_law_of_many_points_runs_on_nine_that_follow_it() {
    let law = |value: fn(f64) -> f64| {
        let voltage_v: Vec<f64> = (0..=32).map(|point| 500.0 * f64::from(point) / 32.0).collect();
        let stiffness = voltage_v.iter().map(|&volts| value(volts)).collect();
        PlantFile { law: Some(Law { voltage_v, stiffness }), ..Plant::PAPER.into() }
    };
    let square = law(|volts| volts * volts / 500.0);
    let text = square.to_toml().unwrap();
    let (of_tick, off) = square.law.as_ref().unwrap().of_tick();
    assert_eq!(parse("p", &text).unwrap().law.unwrap(), of_tick);
    assert_eq!(of_tick.voltage_v, (0..=8).map(|point| 62.5 * f64::from(point)).collect::<Vec<_>>());
    assert!((off - 1.0 / 256.0).abs() < 1e-12, "{off}");
    assert_eq!(parse_for_host("p", &text).unwrap(), square);
    // Two straight lines need one point between them.
    let bent = law(|volts| volts.min(300.0 - 0.5 * (300.0 - volts).min(0.0)));
    assert!(bent.law.unwrap().of_tick().1 < 0.002);
    let waves = law(|volts| volts + 60.0 * (volts / 15.0).sin()).to_toml().unwrap();
    let error = parse("p", &waves).unwrap_err().to_string();
    let expected = "voltage_v = 33 is not allowed: expected 2 to 9 points, or more that lines through 9 of them follow to 0.5 % of the";
    assert!(error.contains(expected), "{error}");
    assert!(parse_for_host("p", &waves).is_ok());
}

#[test]
fn steps_of_the_stair_follow_the_range_of_the_spring() {
    let step = |more: &str, amplifier_v: f64| {
        let file = parse("p", &format!("schema = 1\n{more}\n[relaxation]\nshare = 0.1\ntau_s = 1\n")).unwrap();
        file.stair_step_v(model::Amplifier::up_to(amplifier_v))
    };
    let law = |end: f64| format!("[law]\nvoltage_v = [0, {end}]\nstiffness = [0, {end}]");
    let range = |lowest: f64, highest: f64| format!("[range]\nlowest_v = {lowest}\nhighest_v = {highest}");
    for (more, amplifier_v, expected) in [
        ("", 700.0, 100.0),
        // A range that is only an option's is refused.
        ("", 400.0, 100.0),
        ("[amplifier]\nlimit_v = 500", 700.0, 100.0),
        // A limit that the stair meets is to be seen.
        ("[amplifier]\nlimit_v = 430", 700.0, 100.0),
        ("[amplifier]\nlimit_v = 200", 700.0, 20.0),
        ("[units]\nvoltage = \"%\"", 700.0, 100.0),
        ("[units]\nvoltage = \"%\"", 100.0, 10.0),
        ("[units]\nvoltage = \"%\"\n[amplifier]\nlimit_v = 70", 100.0, 10.0),
        (&law(480.0), 700.0, 100.0),
        (&law(240.0), 700.0, 20.0),
        (&law(5.0), 700.0, 0.5),
        (&range(-5.0, 240.0), 700.0, 20.0),
        (&range(0.0, 5.0), 700.0, 0.5),
        (&range(0.0, 430.0), 700.0, 100.0),
        // Nothing is known of a stair, which is above 0 V, but for a spring that responds to the magnitude.
        (&range(-70.0, 0.0), 700.0, 100.0),
        (&format!("[units]\nvoltage = \"%\"\n{}", range(-70.0, 0.0)), 100.0, 10.0),
        (&format!("even = true\n{}", range(-70.0, 1.0)), 700.0, 10.0),
    ] {
        assert!((step(more, amplifier_v) / expected - 1.0).abs() < 1e-12, "{more} {}", step(more, amplifier_v));
    }
}

#[test]
fn a_range_that_ends_below_its_start_is_refused() {
    let file = |lowest: &str, highest: &str| {
        format!(
            "schema = 1\n[relaxation]\nshare = 0.1\ntau_s = 1\n[range]\nlowest_v = {lowest}\nhighest_v = {highest}\n"
        )
    };
    for read in [parse, parse_for_host] {
        assert!(read("p", &file("5", "5")).is_ok());
        for (lowest, highest, field) in [("5", "4.9", "highest_v"), ("0", "inf", "highest_v"), ("nan", "5", "lowest_v")]
        {
            let error = read("p", &file(lowest, highest)).unwrap_err().to_string();
            assert!(error.contains(&format!("{field} = ")), "{error}");
        }
    }
}
