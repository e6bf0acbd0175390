//! Communication with the host: bytes from and to the line on one side, commands for the control task and updates of the
//! store on the other.
//!
//! | module | content |
//! | --- | --- |
//! | `task` | The task that owns the line. |
//! | `shared_mailbox` | The mailbox between that task and the control task. |
//! | `shared_store` | The store, served by the thread below all tasks. |
//! | `startup` | Construction of controller and server at the start. |

mod shared_mailbox;
mod shared_store;
mod startup;
mod task;

pub use shared_mailbox::Host;
pub use shared_store::serve_store;
pub use startup::open;
pub use task::talk;
