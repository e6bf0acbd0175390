//! Absurd values of every option that takes a number.

use crate::attack::Class;

const VALUES: &[&str] = &[
    "nan",
    "inf",
    "-inf",
    "-1",
    "0",
    "-0.0",
    "1e308",
    "1e-308",
    "1e-12",
    "1e12",
    "1e400",
    "abc",
    "",
    "18446744073709551616",
    "65",
    "1e5",
];

/// Commands with their options.
const OPTIONS: &[(&[&str], &[&str])] = &[
    (&["stair"], &["limit-v", "min-v", "slew-v-per-s", "dac-bits", "kp", "ki", "rate-hz", "every"]),
    (&["stair", "--controller", "fast"], &["approach-s", "slew-v-per-s", "rate-hz", "limit-v", "min-v", "dac-bits"]),
    (&["compare"], &["limit-v", "slew-v-per-s", "rate-hz"]),
    (
        &["beam"],
        &[
            "length-mm",
            "width-mm",
            "thickness-um",
            "modulus-gpa",
            "density",
            "force-un",
            "gravity",
            "at-mm",
            "tolerance",
            "voltage-v",
            "interlayer",
            "elements",
        ],
    ),
    (
        &["joint"],
        &[
            "springs",
            "inner-radius-mm",
            "length-mm",
            "width-mm",
            "thickness-um",
            "stiffness",
            "low",
            "high",
            "within-s",
            "limit-v",
            "slew-v-per-s",
        ],
    ),
    (&["dynamics", "zener"], &["k1", "k2", "damper", "force", "length", "every"]),
    (&["dynamics", "pi-plant"], &["kp", "ki", "every"]),
    (&["dynamics", "spring-damper"], &["k2", "damper", "every", "length"]),
    (&["link", "unix:/nowhere", "status"], &["baud", "timeout"]),
    (&["link", "unix:/nowhere", "set", "300"], &["keep"]),
    (&["link", "unix:/nowhere", "watch"], &["every", "seconds"]),
    (&["link", "unix:/nowhere", "record", "never.csv"], &["rate-hz", "seconds"]),
];

#[test]
fn absurd_numbers_are_refused_or_computed_with() {
    let mut class = Class::new("numbers");
    for (command, options) in OPTIONS {
        for option in *options {
            for value in VALUES {
                let option = format!("--{option}={value}");
                class.add(format!("{} {option}", command.join(" ")), command.iter().copied().chain([option.as_str()]));
            }
        }
    }
    class.run(|_, _| None);
}
