//! The plant file that a diagnosis writes simulates the same readings as the fitted model, for a plant file with any of
//! its tables and any effect in any form (about 170 pairs, less than a second in release mode).

use identify::Input;
use identify::effects::EFFECTS;
use identify::effects::effect::FitContext;
use identify::effects::model::{Block, Model};
use identify::fit::simulator::Simulator;
use identify::plant::base::Base;
use identify::record::data::Data;
use identify::verdict::export;
use simulation::plant_file;
use simulation::record::{Record, Row};

/// The relaxation alone, with each other table, with three kinds of relaxation, and all tables together.
const FILES: [&str; 10] = [
    "",
    "[memory]\ndirect = 0.5\nthresholds_v = [20.0, 45.0]\nweights = [0.3, 0.2]\n",
    "[memory]\ndirect = 0.0\nthresholds_v = [30.0]\nweights = [1.0]\n",
    "[law]\nvoltage_v = [0, 200, 500]\nstiffness = [0, 180, 520]\n",
    "[leakage]\nshare = 0.1\ntau_s = 30.0\n",
    "[amplifier]\nlimit_v = 430.0\nslew_v_per_s = 60.0\ndelay_s = 0.5\n",
    "tau_high_s = 8.0\n",
    "weights = [0.8, 0.1]\n",
    "weights = [0.5, 0.2, 0.1, 0.1]\n",
    "[memory]\ndirect = 0.5\nthresholds_v = [20.0]\nweights = [0.5]\n[law]\nvoltage_v = [0, 200, 500]\n\
     stiffness = [0, 180, 520]\n[leakage]\nshare = 0.1\ntau_s = 30.0\n[amplifier]\nslew_v_per_s = 500.0\ndelay_s = 0.5\n",
];

fn base(tables: &str) -> Base {
    let tau_s = match tables.lines().next().filter(|first| first.starts_with("weights")) {
        Some(weights) if weights.matches(',').count() == 3 => "[5.5, 60.0, 0.5, 600.0]",
        Some(_) => "[5.5, 60.0]",
        None => "5.5",
    };
    let text = format!("schema = 1\n[relaxation]\nshare = 0.1\ntau_s = {tau_s}\n{tables}");
    Base::new(plant_file::parse("base", &text).expect("a plant file")).expect("a base")
}

/// Returns a record of up to 500 V in steps of 100 V, down to 150 V, up again and down.
fn record() -> Record {
    let level = |step: usize| [0.0, 100.0, 200.0, 300.0, 400.0, 500.0, 350.0, 150.0, 320.0, 480.0, 0.0][step.min(10)];
    let row = |index: usize| Row {
        line: index + 2,
        time_s: 0.1 * index as f64,
        voltage_v: level(index / 60),
        measured: Some((index % 7) as f64),
    };
    Record { name: "stair".into(), rows: (0..660).map(row).collect() }
}

/// Returns the model of the same spring before any voltage.
fn from_rest(base: &Base, data: &Data, model: &Model) -> Model {
    let memory = |model: &Model| model.chain(base, data).memory;
    let at_rest = memory(model).at_rest();
    let (Block { effect, .. }, point) = &model.blocks[0];
    let forms = (0..EFFECTS[*effect].forms()).map(|form| Block { effect: *effect, form });
    let alike = forms.filter(|block| block.coordinates(data).len() == point.len());
    std::iter::once(model.clone())
        .chain(alike.map(|block| Model::default().with(block, point.clone())))
        .find(|model| memory(model) == at_rest)
        .expect("a form that begins at rest")
}

#[test]
fn written_plant_file_simulates_the_fitted_model() {
    let data = Data::new(&record(), Input::Hold);
    let run = |base: &Base, model: &Model| {
        let mut readings = Vec::new();
        Simulator::new(&data, base).run(model, &mut readings);
        readings
    };
    let scene = FitContext { data: &data, residual: &data.reading, sigma: 1.0 };
    for tables in FILES {
        let base = base(tables);
        for (effect, it) in EFFECTS.iter().enumerate() {
            for form in 0..it.forms() {
                let starts = it.initial_points(form, &scene);
                let Some(point) = starts.get(starts.len() / 2) else { continue };
                let model = Model::default().with(Block { effect, form }, point.clone());
                // A plant file describes the spring and not the initial state of a record.
                let rests = from_rest(&base, &data, &model);
                let fitted = run(&base, &rests);
                let file = model.extend(&base, &data);
                let remarked =
                    file.unmodelled.iter().flatten().any(|(cause, what)| cause == it.cause() && what.is_str());
                let text = file.to_toml().expect("a text");
                let file = plant_file::parse("written", &text).unwrap_or_else(|error| panic!("{error}\n{text}"));
                let written = run(&Base::new(file).expect("a base"), &model.unmodelled(&base, &data));
                let off = fitted.iter().zip(&written).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                let allowed = match it.cause() {
                    // A curve is written as nine points.
                    "static-nonlinearity" => export::SMALL_ERROR_V,
                    // An instantaneous loss is written as one that the relaxation delays, solved in pieces of 0.1 s.
                    "charge-leakage" => 1e-4,
                    _ => 1e-6,
                };
                // A form that no file can represent is written as the nearest one, with a remark in the file.
                if remarked {
                    assert!(off > 1e-3, "{} in form {form} is written as it was fitted: off by {off} V", it.cause());
                    continue;
                }
                assert!(off <= allowed, "{} in form {form}: off by {off} V on\n{text}", it.cause());
            }
        }
    }
}
