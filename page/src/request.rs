//! The requests by name.

use anyhow::Result;
use identify::Stop;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use simulation::bad_input;

use crate::control::{self, Control};
use crate::diagnose::{self, Records};
use crate::hide::{self, Hidden};
use crate::plan::{self, Planned};

/// A request, as JSON with the field `command`.
#[derive(Deserialize)]
#[serde(tag = "command", rename_all = "kebab-case")]
enum Request {
    /// Runs a target through the controller.
    Control(Control),
    /// Lists the effects that [`Request::Hide`] knows.
    Effects,
    /// Makes a record of a spring with an effect.
    Hide(Hidden),
    /// Identifies the spring of the files.
    Identify(Records),
    /// Diagnoses the files.
    Diagnose(Records),
    /// Plans the experiment after a diagnosis, whose JSON is the file.
    Plan(Planned),
}

/// Answers a request about files, which may be empty. The answer is a JSON object with one field, `ok` or `error`; an error is the
/// line that the command prints. `progress` receives JSON on the way; `stop` ends a diagnosis early.
pub fn answer(request: &[u8], files: &[u8], stop: &Stop, progress: &mut dyn FnMut(&str)) -> String {
    let answer = match of(request, files, stop, progress) {
        Ok(answer) => json!({ "ok": answer }),
        Err(error) => json!({ "error": format!("{error:#}").replace(['\n', '\r'], " ") }),
    };
    answer.to_string()
}

fn of(request: &[u8], files: &[u8], stop: &Stop, progress: &mut dyn FnMut(&str)) -> Result<Value> {
    let request = match serde_json::from_slice(request) {
        Ok(request) => request,
        Err(error) => bad_input!("request: {error}"),
    };
    Ok(match request {
        Request::Control(control) => value(&control::run(&control)?)?,
        Request::Effects => value(&hide::effects())?,
        Request::Hide(hidden) => value(&hide::record(&hidden)?)?,
        Request::Identify(records) => value(&diagnose::identify(&records, files)?)?,
        Request::Diagnose(records) => value(&diagnose::diagnose(&records, files, stop, progress)?)?,
        Request::Plan(planned) => value(&plan::plan(&planned, files)?)?,
    })
}

fn value(answer: &impl Serialize) -> Result<Value> {
    Ok(serde_json::to_value(answer)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_request_is_refused_in_one_line() {
        for request in ["", "{}", r#"{"command":"launch"}"#, r#"{"command":"control"}"#, "\u{0}"] {
            let answer: Value =
                serde_json::from_str(&answer(request.as_bytes(), b"", &Stop::default(), &mut |_| ())).unwrap();
            let error = answer["error"].as_str().expect("an error");
            assert!(error.starts_with("request: ") && !error.contains('\n'), "{error}");
        }
    }

    /// Answers the identification of a first-order record of 200 rows with an order, as JSON.
    fn identified(order: Value) -> Value {
        let mut lag = 0.0;
        let row = |row: u32| {
            let voltage = f64::from(row / 20 * 7 % 5 * 100);
            // Readings of a whole volt: the rounding is the noise.
            let line = format!("{},{voltage},{}\n", f64::from(row) * 0.5, f64::round(0.1 * voltage + 0.9 * lag));
            lag += (voltage - lag) * 0.1;
            line
        };
        let file = "time_s,voltage_v,stiffness\n".to_owned() + &(0..200).map(row).collect::<String>();
        let files = json!([{ "name": "r.csv", "length": file.len() }]);
        let request = json!({
            "command": "identify", "files": files, "input": "hold", "plant": "paper", "effort": "quick", "order": order
        });
        let said = answer(request.to_string().as_bytes(), file.as_bytes(), &Stop::default(), &mut |_| ());
        serde_json::from_str(&said).unwrap()
    }

    #[test]
    fn an_identification_has_the_order_that_is_asked_for() {
        for order in 1..=3 {
            let answer = identified(json!(order));
            let report: Value = serde_json::from_str(answer["ok"]["json"].as_str().expect("an answer")).unwrap();
            assert_eq!(report["order"], order, "{report}");
        }
        assert!(identified(Value::Null)["ok"].is_object());
        assert_eq!(identified(json!(5))["error"], "order 5: expected 1 to 4");
    }
}
