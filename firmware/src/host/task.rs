//! The task that owns the line to the host.

use embassy_time::{Duration, Timer, with_timeout};
use link::{Server, Step, View};

use super::shared_mailbox::{capture, hand_over, with_mailbox};
use super::shared_store;
use crate::board::Line;
use crate::task_watchdog::{TASK_WATCHDOG, Task};
use crate::{adaptation, isolation, stop};

/// Longest wait for a byte, and thereby the period of the check whether telemetry is due.
const READ_TIMEOUT: Duration = Duration::from_millis(1);
/// Longest wait until the line accepts a frame; the longest frame needs less. If the host does not read, the rest of the frame
/// is lost and the host repeats its request, but this task still checks in.
const WRITE_TIMEOUT: Duration = Duration::from_millis(20);

/// Runs the server on the line.
pub async fn talk(line: &mut impl Line, server: &mut Server) -> ! {
    TASK_WATCHDOG.register(Task::Link);
    let mut buffer = [0; 32];
    loop {
        TASK_WATCHDOG.check_in(Task::Link);
        let count = with_timeout(READ_TIMEOUT, line.read(&mut buffer)).await.unwrap_or(0);
        for byte in buffer.iter().take(count) {
            // None before the first tick: there is no state to report yet, and hosts repeat their requests.
            let Some(view) = with_mailbox(|mailbox| mailbox.view()) else { break };
            report_faults(line, server, &view).await;
            if let Some(step) = server.on_byte(*byte, &view) {
                let restarts = matches!(step, Step::Restart(_));
                // One place for all to be sent from; the replies are not kept meanwhile.
                let bytes = match step {
                    Step::Send(bytes) | Step::Restart(bytes) => bytes,
                    Step::Command(command) => {
                        let after = hand_over(command, view.state).await;
                        report_faults(line, server, &after).await;
                        server.command_done(&after)
                    }
                    Step::Update(block, update) => {
                        let result = shared_store::update(block, update).await;
                        // Erasing a page takes many ticks.
                        let after = with_mailbox(|mailbox| mailbox.view()).unwrap_or(view);
                        server.updated(block, result, &after)
                    }
                    Step::ReadSettings { built_in, number } => {
                        let part = shared_store::settings_part(built_in, number).await;
                        server.settings_part(part)
                    }
                    Step::Capture(request) => server.answered(&capture(request)),
                    Step::Isolation(request) => server.answered(&isolation::execute(request, view.sample.tick).await),
                    Step::Adaptation(request) => server.answered(&adaptation::execute(request, view.sample.tick).await),
                };
                send(line, bytes).await;
                if restarts {
                    // Until the last bytes have been sent.
                    Timer::after(WRITE_TIMEOUT).await;
                    stop::restart()
                }
            }
            if server.take_heard() {
                with_mailbox(|mailbox| mailbox.hear());
            }
        }
        if let Some(view) = with_mailbox(|mailbox| mailbox.view()) {
            report_faults(line, server, &view).await;
            if let Some(bytes) = server.telemetry(&view)
                && !send(line, bytes).await
            {
                server.telemetry_lost();
            }
            if let Some(bytes) = verdict(server, &view)
                && !send(line, bytes).await
            {
                server.verdict_lost();
            }
        }
    }
}

/// Sends the reports of faults that are due, at most one for each code of a fault, ahead of everything else.
async fn report_faults(line: &mut impl Line, server: &mut Server, view: &View) {
    while let Some(bytes) = server.fault(view) {
        send(line, bytes).await;
    }
}

/// Returns the frame of what the isolation bank says with the telemetry, if it is due.
// Not a part of the task, which would keep the notice in RAM while the frame is sent.
#[inline(never)]
fn verdict<'a>(server: &'a mut Server, view: &View) -> Option<&'a [u8]> {
    let (verdict, notice) = isolation::notice(view.sample.tick, |verdict| server.verdict_due(verdict, view))?;
    Some(server.verdict(verdict, &notice, view))
}

/// Sends a frame. False after a timeout: the frame is incomplete then, and the host drops it. The task checks in before it waits for the
/// line, because it may have waited for a page to be erased or for the adaptation, and that counts by itself.
async fn send(line: &mut impl Line, bytes: &[u8]) -> bool {
    TASK_WATCHDOG.check_in(Task::Link);
    let sent = with_timeout(WRITE_TIMEOUT, line.write(bytes)).await.is_ok();
    TASK_WATCHDOG.check_in(Task::Link);
    sent
}
