//! Subscriptions to the topics of a depth camera.

use super::endpoint::{WAKE, best_effort, reliable, watch};
use super::{dds_topic, open_node};
use crate::camera::{CameraMessage, CameraTopics};
use crate::definition::HasDefinition;
use crate::message::Image;
use crate::settings::RosSettings;
use crate::transport::cannot_open;
use crate::view::{CameraInfo, PointCloud2};
use palpate_input::error::InputError;
use ros2_client::Node;
use rustdds::mio1::{Events, Poll};
use serde::de::DeserializeOwned;
use std::time::Instant;

/// Returns a new message of a topic, if there is one.
type Reader = Box<dyn Fn() -> Option<CameraMessage>>;

/// Passes messages of the camera on until `take` returns true or the time is over; returns the
/// names of the topics with clouds and images that are published.
///
/// # Errors
/// If the network cannot be joined.
pub fn listen(
    settings: &RosSettings,
    topics: &CameraTopics,
    take: &mut dyn FnMut(CameraMessage) -> bool,
) -> Result<Vec<String>, InputError> {
    let (context, mut node) = open_node(settings, "viewer")?;
    let mut poll = Poll::new().map_err(cannot_open("a poll"))?;
    let _waker =
        rustdds::mio1::Waker::new(poll.registry(), WAKE).map_err(cannot_open("a waker"))?;
    let mut readers = Vec::new();
    subscribe::<PointCloud2>(&mut node, &poll, &mut readers, topics.view)?;
    subscribe::<Image>(&mut node, &poll, &mut readers, topics.view)?;
    subscribe::<CameraInfo>(&mut node, &poll, &mut readers, &topics.info())?;
    let end = Instant::now() + topics.timeout;
    let mut events = Events::with_capacity(64);
    while let Some(left) = end.checked_duration_since(Instant::now()) {
        // Interruptions of a wait are ignored.
        let _ = poll.poll(&mut events, Some(left));
        if readers.iter().filter_map(|reader| reader()).any(&mut *take) {
            break;
        }
    }
    let is_view = |name: &str| {
        [PointCloud2::DEFINITION, Image::DEFINITION]
            .iter()
            .any(|kind| name.contains(kind.short_name()))
    };
    let mut names: Vec<String> = (context.domain_participant().discovered_writers().iter())
        .filter(|writer| is_view(&writer.publication_topic_data.type_name))
        .filter_map(|writer| {
            Some(writer.publication_topic_data.topic_name.strip_prefix("rt")?.to_owned())
        })
        .collect();
    names.sort();
    names.dedup();
    Ok(names)
}

/// Subscribes twice: a driver that publishes without confirmation has no reliable reader, and a
/// large message of another arrives in whole only by confirmations.
fn subscribe<M>(
    node: &mut Node,
    poll: &Poll,
    readers: &mut Vec<Reader>,
    name: &str,
) -> Result<(), InputError>
where
    M: HasDefinition + DeserializeOwned + Into<CameraMessage> + 'static,
{
    for qos in [best_effort(), reliable()] {
        let dds = dds_topic::<M>(node, name, &qos)?;
        let mut subscription =
            node.create_subscription::<M>(&dds, Some(qos)).map_err(cannot_open(name))?;
        watch(poll, &mut subscription, name)?;
        // A message that cannot be decoded is passed over, as the next may be whole.
        readers.push(Box::new(move || {
            let (message, _) = subscription.take().ok()??;
            Some(message.into())
        }));
    }
    Ok(())
}
