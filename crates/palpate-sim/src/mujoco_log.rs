//! Log of MuJoCo.

use mujoco_rs::wrappers::mj_logging::{log_config, set_log_config};
use std::sync::Once;

/// Stops MuJoCo from writing messages; call it before any model is compiled.
pub(crate) fn quiet() {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        // A diverging trial is a fault in its row, not a line in MUJOCO_LOG.TXT.
        let quiet = log_config().with_logto_console(false).with_logto_file(false);
        // SAFETY: no thread can use MuJoCo yet, because this precedes every model.
        unsafe { set_log_config(quiet) };
    });
}
