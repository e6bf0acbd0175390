//! The control task, and the housekeeping task with a lower priority.

use core::sync::atomic::Ordering;

use embassy_time::{Duration, Instant, Timer, with_timeout};
use model::supervisor::{Fault, Faults};
use model::{Limits, Sensor, Volts, device};

use crate::board::{Amplifier, Board};
use crate::control::{Control, Sensors, Source, Stopwatch, Tick};
use crate::fault_lines::FaultLines;
use crate::isolation::Isolation;
use crate::log::{self, EVENTS, Event, Summary, queue, try_queue};
use crate::pace::Pace;
use crate::task_watchdog::{TASK_WATCHDOG, Task};
use crate::{adaptation, crash_record, hang_guard, stop};

/// Times of the control task.
#[derive(Clone, Copy, Debug)]
pub struct Timing {
    rate_hz: u32,
    /// Time after a tick in which the next one has to end, in ms.
    hang_ms: u32,
    /// Ticks without a complete round of the task watchdog after which the output is disabled.
    incomplete_ticks: u32,
    /// Number of the first tick.
    first_tick: u64,
}

impl Timing {
    /// The times of valid `settings`.
    pub fn of(settings: &device::Settings) -> Self {
        let rate_hz = settings.rate_hz();
        let device::Watchdogs { hang_ms, stall_ms, .. } = settings.watchdogs;
        Self { rate_hz, hang_ms, incomplete_ticks: rate_hz * stall_ms / 1000, first_tick: 0 }
    }

    /// Returns these times with ticks counted from `first_tick` on, as on a board that has run for weeks.
    pub fn counted_from(self, first_tick: u64) -> Self {
        Self { first_tick, ..self }
    }
}

/// Runs control ticks, and after each of them the isolation bank, until `source` ends. Returns the numbers of executed and of
/// missed ticks.
pub async fn control<B: Board>(
    board: &mut B,
    control: &mut Control,
    isolation: &mut Isolation,
    source: &mut impl Source,
    stopwatch: &mut impl Stopwatch,
    timing: Timing,
) -> (u64, u32) {
    TASK_WATCHDOG.register(Task::Control);
    let mut pace = Pace::new(Instant::now().as_micros(), u64::from(1_000_000 / timing.rate_hz.max(1)));
    let state = link::State::from(control.supervisor()).name();
    let mut report = Report { rate_hz: timing.rate_hz, state, ..Report::default() };
    let mut incomplete: u32 = 0;
    let mut ticks = timing.first_tick;
    loop {
        Timer::at(Instant::from_micros(pace.due_us())).await;
        let arrival = pace.arrive(Instant::now().as_micros());
        let Some(command) = source.command(ticks) else { break };
        if source.take_acknowledged() {
            isolation.acknowledge();
        }
        let cause = isolation.begin(&command, control.supervisor().state());
        let stalled = (incomplete > timing.incomplete_ticks).then_some(Fault::Watchdog);
        let sensors = Sensors {
            interlock_closed: board.interlock_closed(),
            missed_ticks: arrival.missed_ticks,
            monitors: board.amplifier().monitors(),
            faults: stalled.into_iter().chain(board.fault()).chain(cause).collect(),
            measured: board.amplifier().measured(),
        };
        let tick = control.tick(&command, &sensors, stopwatch);
        board.amplifier().put(tick.drive);
        board.show_armed(tick.drive.enabled());
        report.overruns = report.overruns.saturating_add(arrival.missed_ticks);
        source.done(&tick, control, report.overruns);

        ticks += 1;
        // The log has the low 32 bits.
        stop::TICK.store(ticks as u32, Ordering::Relaxed);
        report.late(arrival.lateness_us);
        report.tick(ticks as u32, control, &tick);
        // Last: nothing of the output waits for it.
        if let Some(news) = isolation.tick(control, &tick) {
            source.isolated(&news);
            log::isolation(&news, ticks);
        }
        adaptation::after_tick(control, isolation, &tick, ticks);

        hang_guard::feed(timing.hang_ms);
        TASK_WATCHDOG.check_in(Task::Control);
        if TASK_WATCHDOG.complete() {
            incomplete = 0;
            board.feed_watchdog();
        } else {
            incomplete = incomplete.saturating_add(1);
        }
    }
    hang_guard::rest();
    (ticks - timing.first_tick, report.overruns)
}

/// The last reported values, so that only changes are logged.
#[derive(Default)]
struct Report {
    rate_hz: u32,
    state: &'static str,
    standing: Faults,
    unlogged: FaultLines,
    limits: Limits,
    sensor: Option<Sensor>,
    overruns: u32,
    worst_lateness_us: u32,
    squared_lateness_us2: u32,
    limited_ticks: u32,
}

impl Report {
    fn late(&mut self, us: u32) {
        self.worst_lateness_us = self.worst_lateness_us.max(us);
        self.squared_lateness_us2 = self.squared_lateness_us2.saturating_add(us.saturating_mul(us));
    }

    fn tick(&mut self, number: u32, control: &Control, tick: &Tick) {
        let supervisor = control.supervisor();
        let (state, standing) = (link::State::from(supervisor).name(), supervisor.standing());
        if state != self.state || standing != self.standing {
            crash_record::set(supervisor.state(), standing);
        }
        if state != self.state {
            queue(Event::State(self.state, state));
            self.state = state;
        }
        if standing != self.standing {
            self.unlogged.add(standing.except(self.standing), number);
            self.standing = standing;
        }
        self.unlogged.pass(|fault, tick| {
            let is_queued = try_queue(Event::Fault(fault, tick));
            if let (true, Fault::Monitor, Some(mismatch)) = (is_queued, fault, supervisor.mismatch()) {
                queue(Event::Mismatch(mismatch, tick));
            }
            is_queued
        });
        let limits = supervisor.limits(&tick.output);
        if limits != self.limits {
            queue(Event::Limits(limits.bits(), number));
            self.limits = limits;
        }
        if let Some(sensor) = tick.output.sensor
            && self.sensor != Some(sensor)
        {
            queue(Event::Sensor(sensor, number));
            self.sensor = Some(sensor);
        }
        self.limited_ticks = self.limited_ticks.saturating_add(u32::from(limits != Limits::NONE));
        if number.is_multiple_of(self.rate_hz) {
            queue(Event::Summary(Summary {
                tick: number,
                overruns: self.overruns,
                worst_lateness_us: self.worst_lateness_us,
                squared_lateness_us2: core::mem::take(&mut self.squared_lateness_us2),
                limited_ticks: self.limited_ticks,
                state,
                target: tick.output.target,
                applied: tick.output.applied,
                stiffness: Volts(tick.output.stiffness.0),
            }));
        }
    }
}

/// Logs the events that the control task has queued, plans the adaptation, and checks in. `each` is called after every event, and with `None` once
/// the queue has been empty for 10 ms.
pub async fn housekeeping(mut each: impl FnMut(Option<&Event>)) -> ! {
    TASK_WATCHDOG.register(Task::Housekeeping);
    let mut planner = adaptation::Planner::begin();
    loop {
        let event = with_timeout(Duration::from_millis(10), EVENTS.receive()).await.ok();
        if let Some(event) = event {
            log::event(event);
        }
        each(event.as_ref());
        adaptation::serve(&mut planner);
        TASK_WATCHDOG.check_in(Task::Housekeeping);
    }
}
