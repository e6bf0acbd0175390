//! The variants of an image: one for each controller and each amplifier.

/// The controller that an image runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Controller {
    /// The paper's
    Paper,
    /// The time-optimal one, in an image of its own
    Fast,
    /// The one for a spring that is known to within errors, in an image of its own
    Robust,
}

impl Controller {
    /// Every controller.
    pub const ALL: [Self; 3] = [Self::Paper, Self::Fast, Self::Robust];

    /// Features of the package `firmware` that the controller needs.
    pub const fn features(self) -> &'static [&'static str] {
        match self {
            Self::Paper => &[],
            Self::Fast => &["fast"],
            Self::Robust => &["robust"],
        }
    }
}

/// The amplifier's highest voltage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Limit {
    /// The report's range
    #[value(name = "700")]
    Paper,
    /// In an image of its own
    #[value(name = "1000")]
    Kilovolt,
}

impl Limit {
    /// Every amplifier.
    pub const ALL: [Self; 2] = [Self::Paper, Self::Kilovolt];

    const fn features(self) -> &'static [&'static str] {
        match self {
            Self::Paper => &[],
            Self::Kilovolt => &["kilovolt"],
        }
    }
}

/// One variant of an image, as command line options.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::Args)]
pub struct Variant {
    /// Controller of the image
    #[arg(long, value_enum, default_value = "paper")]
    pub controller: Controller,
    /// Highest voltage of the amplifier, in V
    #[arg(long, value_enum, default_value = "700", value_name = "V")]
    pub limit_v: Limit,
}

impl Variant {
    /// Every variant.
    pub const ALL: [Self; 6] = [
        Self::of(Controller::Paper),
        Self { controller: Controller::Paper, limit_v: Limit::Kilovolt },
        Self::of(Controller::Fast),
        Self { controller: Controller::Fast, limit_v: Limit::Kilovolt },
        Self::of(Controller::Robust),
        Self { controller: Controller::Robust, limit_v: Limit::Kilovolt },
    ];

    /// The variant with this controller and the report's amplifier of 700 V.
    pub const fn of(controller: Controller) -> Self {
        Self { controller, limit_v: Limit::Paper }
    }

    /// Every variant but this one.
    pub fn others(self) -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(move |other| *other != self)
    }

    /// Features of the package `firmware` that the variant needs.
    pub fn features(self) -> Vec<&'static str> {
        [self.controller.features(), self.limit_v.features()].concat()
    }

    /// Name of the counts of a command that was run on this variant.
    pub fn tally(self, command: &str) -> String {
        [&[command], self.features().as_slice()].concat().join("-")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Args, FromArgMatches};

    fn parse(line: &str) -> Result<Variant, clap::Error> {
        let command = Variant::augment_args(clap::Command::new("image").no_binary_name(true));
        Variant::from_arg_matches(&command.try_get_matches_from(line.split_whitespace())?)
    }

    #[test]
    fn options_select_features() {
        for (line, features) in [
            ("", &[][..]),
            ("--limit-v 700", &[]),
            ("--controller fast", &["fast"]),
            ("--controller fast --limit-v 1000", &["fast", "kilovolt"]),
            ("--limit-v 1000 --controller robust", &["robust", "kilovolt"]),
        ] {
            assert_eq!(parse(line).unwrap().features(), features, "{line}");
        }
        // As `cargo xtask counts` looks for it.
        assert_eq!(parse("--controller fast --limit-v 1000").unwrap().tally("boot"), "boot-fast-kilovolt");
        let error = parse("--limit-v 850").unwrap_err().to_string();
        assert!(error.contains("850") && error.contains("[possible values: 700, 1000]"), "{error}");
    }

    #[test]
    fn every_controller_has_a_variant_for_every_amplifier() {
        let each = |controller| Limit::ALL.map(|limit_v| Variant { controller, limit_v });
        assert!(Controller::ALL.into_iter().flat_map(each).eq(Variant::ALL));
        assert_eq!(Variant::ALL[1].others().count(), 5);
    }
}
