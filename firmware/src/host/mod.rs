//! Communication with the host: bytes from and to the line on one side, commands for the control task and updates of the
//! model store on the other.
//!
//! | module | content |
//! | --- | --- |
//! | `task` | The task that owns the line. |
//! | `shared_mailbox` | The mailbox between that task and the control task. |
//! | `model_store` | The model store, served by the thread below all tasks. |
//! | `startup` | Construction of controller and server at the start. |

mod model_store;
mod shared_mailbox;
mod startup;
mod task;

pub use model_store::serve_model_store;
pub use shared_mailbox::Host;
pub use startup::open;
pub use task::talk;
