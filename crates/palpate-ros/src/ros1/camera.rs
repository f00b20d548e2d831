//! Subscriptions to the topics of a depth camera.

use super::wire::SequencedMessage;
use crate::camera::{CameraMessage, CameraTopics};
use crate::message::Image;
use crate::settings::RosSettings;
use crate::transport::cannot_open;
use crate::view::{CameraInfo, PointCloud2};
use palpate_input::error::InputError;
use roslibrust::RosMessageType;
use roslibrust::ros1::NodeHandle;
use std::sync::mpsc::{Sender, channel};
use std::time::Instant;
use tokio::runtime::Runtime;

/// Passes messages of the camera on until `take` returns true or the time is over; returns no
/// names, which the master does not tell by their type.
///
/// # Errors
/// If there is no master, or it rejects the node.
pub fn listen(
    settings: &RosSettings,
    topics: &CameraTopics,
    take: &mut dyn FnMut(CameraMessage) -> bool,
) -> Result<Vec<String>, InputError> {
    let runtime = Runtime::new().map_err(cannot_open("threads"))?;
    let (name, master) = (format!("/palpate_viewer_{}", std::process::id()), &settings.master);
    let node = runtime
        .block_on(NodeHandle::new(master, &name))
        .map_err(cannot_open(&format!("a node at the master {master}")))?;
    let (inlet, outlet) = channel();
    subscribe::<PointCloud2>(&runtime, &node, &inlet, topics.view)?;
    subscribe::<Image>(&runtime, &node, &inlet, topics.view)?;
    subscribe::<CameraInfo>(&runtime, &node, &inlet, &topics.info())?;
    let end = Instant::now() + topics.timeout;
    while let Some(left) = end.checked_duration_since(Instant::now()) {
        let Ok(message) = outlet.recv_timeout(left) else { break };
        if take(message) {
            break;
        }
    }
    Ok(Vec::new())
}

fn subscribe<M>(
    runtime: &Runtime,
    node: &NodeHandle,
    inlet: &Sender<CameraMessage>,
    name: &str,
) -> Result<(), InputError>
where
    M: Into<CameraMessage> + Send + 'static,
    SequencedMessage<M>: RosMessageType,
{
    let mut subscriber = runtime
        .block_on(node.subscribe::<SequencedMessage<M>>(name, 1))
        .map_err(cannot_open(name))?;
    let inlet = inlet.clone();
    runtime.spawn(async move {
        while let Some(message) = subscriber.next().await {
            // A message of another type under this name is passed over.
            let Ok(counted) = message else { continue };
            if inlet.send(counted.message.into()).is_err() {
                break;
            }
        }
    });
    Ok(())
}
