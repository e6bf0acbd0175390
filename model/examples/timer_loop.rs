//! The loop of a firmware's timer interrupt, run on a host: `cargo run -p vsj-model --example timer_loop` prints a short
//! trace.
//!
//! To use it in a firmware, copy [`Controller`] and [`Board`], implement `Board` for your pins, build the controller
//! once at the start, and call [`Controller::on_timer`] from the interrupt of a timer that fires [`RATE_HZ`] times per
//! second. What is left is the simulation of a board, so that the example prints something.

use model::estimator::Estimator;
use model::stiffness::{Cantilever, Desired, YoungsModulus};
use model::supervisor::{self, Command, Decision, Drive, Inputs, Supervisor};
use model::{
    Amplifier, Config, DacCode, Input, OutOfRange, Output, Plant, SampleTime, Settings, Spring, State, Validate, Volts,
};

/// Ticks per second.
const RATE_HZ: f64 = 1000.0;

/// What the loop needs of a board.
trait Board {
    /// Returns true if the safety circuit is closed.
    fn interlock_closed(&self) -> bool;

    /// Writes the code to the DAC, and sets the enable input of the amplifier.
    fn write(&mut self, drive: Drive);
}

/// Everything that lives from tick to tick. Its size is known at compile time: it may be a `static`.
struct Controller {
    config: Config,
    state: State,
    supervisor: Supervisor,
    ticks_since_host: u32,
}

impl Controller {
    /// Builds configuration and supervisor once, off the hot path. This is the only place with floats.
    fn new(settings: &Settings, supervision: &supervisor::Settings) -> Result<Self, OutOfRange> {
        let validated = settings.validate()?;
        let supervision = supervision.validate(validated.sample_time())?;
        Ok(Self {
            config: validated.quantize(),
            state: State::default(),
            supervisor: Supervisor::new(supervision.quantize(), None),
            ticks_since_host: u32::MAX,
        })
    }

    /// One tick. `host` is what a valid frame of the host ordered since the last tick, if one came.
    fn on_timer(&mut self, board: &mut impl Board, target: Volts, host: Option<Option<Command>>) -> Output {
        self.ticks_since_host = if host.is_some() { 0 } else { self.ticks_since_host.saturating_add(1) };
        let decision = self.supervisor.decide(&Inputs {
            command: host.flatten(),
            target,
            ticks_since_host: self.ticks_since_host,
            interlock_closed: board.interlock_closed(),
            ..Inputs::default()
        });
        let output = match decision {
            Decision::Rest => self.config.rest(&mut self.state, None),
            Decision::Start(target) => {
                self.config.bumpless_transfer(&mut self.state, Volts::ZERO);
                self.config.tick(&mut self.state, Input { target, measured: None })
            }
            Decision::Pursue(target) => self.config.tick(&mut self.state, Input { target, measured: None }),
        };
        board.write(self.supervisor.release(&output));
        output
    }
}

/// A board on the host: an amplifier of 700 V and a real spring that is 10 % slower than the controller's model.
struct Simulated {
    tick: u32,
    code: DacCode,
    spring: <Plant as model::estimator::Model>::Config,
    state: model::estimator::State,
    stiffness_v: f64,
}

impl Board for Simulated {
    fn interlock_closed(&self) -> bool {
        // It opens after 12 s.
        self.tick < 12_000
    }

    fn write(&mut self, drive: Drive) {
        self.code = if drive.enabled() { drive.code() } else { DacCode(0) };
        let applied_v = f64::from(self.code.0) * Amplifier::PAPER.volts_per_code();
        let applied = Volts::new(applied_v).unwrap_or_default();
        self.stiffness_v = self.spring.run(&mut self.state, applied).to_f64();
        self.tick += 1;
    }
}

fn main() -> Result<(), OutOfRange> {
    let settings = Settings { rate_hz: RATE_HZ, ..Settings::PAPER };
    let mut controller = Controller::new(&settings, &supervisor::Settings::DEFAULT)?;
    let amplifier = &settings.amplifier;
    let spring = Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, amplifier.min_v, amplifier.max_v)?;
    let target = spring.target(Desired::NewtonPerMetre(0.25))?;

    let slower = Plant { time_constant_s: 1.1 * Plant::PAPER.time_constant_s, ..Plant::PAPER };
    let mut board = Simulated {
        tick: 0,
        code: DacCode(0),
        spring: slower.validate(SampleTime::from_rate(RATE_HZ)?)?.quantize(),
        state: Default::default(),
        stiffness_v: 0.0,
    };
    println!("  time      state  code   estimate      real");
    for tick in 0..14_000 {
        // The host sends a frame in every tick, and arms in the first one.
        let command = (tick == 0).then_some(Command::Arm);
        let output = controller.on_timer(&mut board, target, Some(command));
        if tick % 1000 == 0 {
            let (estimate, real) = (output.stiffness.to_f64(), board.stiffness_v);
            println!(
                "{:4} s {:>12} {:5} {:6.4} N/m {:6.4} N/m",
                tick / 1000,
                format!("{:?}", controller.supervisor.state()).split('(').next().unwrap_or_default(),
                board.code.0,
                spring.newton_per_metre(estimate),
                spring.newton_per_metre(real),
            );
        }
    }
    println!("state at the end: {:?}", controller.supervisor.state());
    Ok(())
}
