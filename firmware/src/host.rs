//! The host's task.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`mailbox`] | its orders, as the control task's source |
//! | [`keeper`] | the store of models, below all tasks |
//! | [`opening`] | controller and desk, at the start |

mod keeper;
mod mailbox;
mod opening;

use core::future::Future;

use embassy_time::{Duration, Timer, with_timeout};
use link::{Desk, Step};

pub use keeper::keep;
pub use mailbox::Host;
pub use opening::open;

use crate::post::Letter;
use crate::roll_call::Member;
use crate::stop;
use crate::tasks::ROLL_CALL;
use mailbox::{hand_over, with_post};

/// Longest wait for a byte: so often is looked whether telemetry is due.
const LISTEN: Duration = Duration::from_millis(1);
/// Longest wait until the line takes an answer, longer than it needs for the longest one. A host that does not read must
/// not keep this task from the roll call; the rest of the answer is lost, and the host asks again.
const SPEAK: Duration = Duration::from_millis(20);

/// Where bytes come from and go to.
pub trait Line {
    /// Waits for bytes; how many came. May be dropped while waiting, without loss.
    fn read(&mut self, buffer: &mut [u8]) -> impl Future<Output = usize>;

    /// Sends all of `bytes`.
    fn write(&mut self, bytes: &[u8]) -> impl Future<Output = ()>;
}

/// Between the host and the control task, for ever.
pub async fn talk(line: &mut impl Line, desk: &mut Desk) -> ! {
    ROLL_CALL.enrol(Member::Link);
    let mut buffer = [0; 32];
    loop {
        ROLL_CALL.check_in(Member::Link);
        let count = with_timeout(LISTEN, line.read(&mut buffer)).await.unwrap_or(0);
        for byte in buffer.iter().take(count) {
            // None before the first tick: nobody can be answered yet, and hosts ask again.
            let Some(view) = with_post(|post| post.view()) else { break };
            match desk.on_byte(*byte, &view) {
                None => {}
                Some(Step::Send(bytes)) => say(line, bytes).await,
                Some(Step::Order(order)) => {
                    let heard = desk.take_heard();
                    let after = hand_over(Letter { order, made_in: view.state }, heard).await;
                    say(line, desk.settle(&after)).await;
                }
                Some(Step::Keep(keep)) => {
                    say(line, desk.kept(keeper::kept(keep).await, &view)).await;
                }
                Some(Step::Restart(bytes)) => {
                    say(line, bytes).await;
                    // Until the last bytes have left.
                    Timer::after(SPEAK).await;
                    stop::restart()
                }
            }
            if desk.take_heard() {
                with_post(|post| post.hear(true));
            }
        }
        if let Some(view) = with_post(|post| post.view())
            && let Some(bytes) = desk.telemetry(&view)
        {
            say(line, bytes).await;
        }
    }
}

async fn say(line: &mut impl Line, bytes: &[u8]) {
    // A timeout needs no answer of its own: the frame is cut off, and the host drops it.
    let _ = with_timeout(SPEAK, line.write(bytes)).await;
    ROLL_CALL.check_in(Member::Link);
}
