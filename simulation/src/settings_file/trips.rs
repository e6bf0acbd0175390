//! The value of `trip_on_cause`: `"off"`, or a list of cause codes.

use std::fmt;

use model::isolation::{Cause, Causes};
use serde::de::{Error, SeqAccess, Unexpected, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The word for no cause.
const OFF: &str = "off";

/// Causes that are a fault once the isolation bank has named them; `off` for none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Trips(pub Causes);

impl Serialize for Trips {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.0.is_empty() {
            serializer.serialize_str(OFF)
        } else {
            serializer.collect_seq(self.0.iter().map(Cause::name))
        }
    }
}

impl<'de> Deserialize<'de> for Trips {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Reader)
    }
}

struct Reader;

impl<'de> Visitor<'de> for Reader {
    type Value = Trips;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "\"{OFF}\" or a list of {}", Cause::ALL.map(Cause::name).join(", "))
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<Trips, E> {
        if word == OFF { Ok(Trips::default()) } else { Err(E::invalid_value(Unexpected::Str(word), &self)) }
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Trips, A::Error> {
        let mut causes = Causes::NONE;
        while let Some(name) = list.next_element::<String>()? {
            let cause = Cause::named(&name);
            causes = causes.with(cause.ok_or_else(|| A::Error::invalid_value(Unexpected::Str(&name), &self))?);
        }
        Ok(Trips(causes))
    }
}
