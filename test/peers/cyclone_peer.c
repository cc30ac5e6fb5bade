// A robot and a subscriber of another vendor: Eclipse Cyclone DDS, with types that its own
// generator made of the installed IDL. Publishes the frames of a file as a robot does
// (frames_file.hpp) and writes all that the component says to another file (peer_log.hpp).
//
//   cyclone_peer DOMAIN FRAMES LOG
//
// Says on stderr "matched", "sent", and "converged" when the last manifest fits what it holds; ends
// on SIGTERM.
#include <dds/dds.h>
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "nav_msgs.h"
#include "pocd_interfaces.h"
#include "pocd_msgs.h"
#include "sensor_msgs.h"
#include "tf2_msgs.h"

enum { kBatch = 64, kPollMs = 10 };

static volatile sig_atomic_t stopping = 0;
static FILE* log_file;

static void on_signal(int number) {
  (void)number;
  stopping = 1;
}

static void fail(const char* what) {
  fprintf(stderr, "cyclone_peer: %s\n", what);
  exit(1);
}

static dds_entity_t checked(dds_entity_t entity, const char* what) {
  if (entity < 0) fail(what);
  return entity;
}

static void put(const void* data, size_t size) {
  if (fwrite(data, 1, size, log_file) != size) fail("cannot write the log");
}
#define PUT(value) put(&(value), sizeof(value))

static void get(FILE* file, void* data, size_t size) {
  if (fread(data, 1, size, file) != size) fail("the frames end too early");
}

// ---- what a robot sends ----

typedef struct {
  dds_entity_t depth, labels, info, odometry, tf_static;
} Robot;

static dds_entity_t writer(dds_entity_t participant, const dds_topic_descriptor_t* type,
                           const char* name, bool latched) {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(10));
  dds_qset_durability(qos, latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, latched ? DDS_HISTORY_KEEP_LAST : DDS_HISTORY_KEEP_ALL, 1);
  const dds_entity_t topic =
      checked(dds_create_topic(participant, type, name, NULL, NULL), "no topic");
  const dds_entity_t result =
      checked(dds_create_writer(participant, topic, qos, NULL), "no writer");
  dds_delete_qos(qos);
  return result;
}

static void write_sample(dds_entity_t to, const void* sample) {
  if (dds_write(to, sample) != DDS_RETCODE_OK) fail("a sample could not be written");
}

static int matched(dds_entity_t entity) {
  dds_publication_matched_status_t status;
  return dds_get_publication_matched_status(entity, &status) == DDS_RETCODE_OK
             ? (int)status.current_count
             : 0;
}

static std_msgs_msg_dds__Header_ header(int64_t stamp_ns, char* frame) {
  std_msgs_msg_dds__Header_ result;
  result.stamp.sec = (int32_t)(stamp_ns / 1000000000);
  result.stamp.nanosec = (uint32_t)(stamp_ns % 1000000000);
  result.frame_id = frame;
  return result;
}

static void send_image(dds_entity_t to, std_msgs_msg_dds__Header_ head, char* encoding,
                       const uint32_t size[2], uint32_t pixel_bytes, uint8_t* pixels) {
  sensor_msgs_msg_dds__Image_ image;
  memset(&image, 0, sizeof image);
  image.header = head;
  image.width = size[0];
  image.height = size[1];
  image.encoding = encoding;
  image.step = size[0] * pixel_bytes;
  image.data._buffer = pixels;
  image.data._length = image.data._maximum = image.step * size[1];
  write_sample(to, &image);
}

static void send_mount(const Robot* robot, const double mount[7]) {
  geometry_msgs_msg_dds__TransformStamped_ transform;
  memset(&transform, 0, sizeof transform);
  transform.header = header(0, "base");
  transform.child_frame_id = "camera";
  memcpy(&transform.transform.translation, mount, 3 * sizeof(double));
  memcpy(&transform.transform.rotation, mount + 3, 4 * sizeof(double));
  tf2_msgs_msg_dds__TFMessage_ message;
  memset(&message, 0, sizeof message);
  message.transforms._buffer = &transform;
  message.transforms._length = message.transforms._maximum = 1;
  write_sample(robot->tf_static, &message);
}

// False at the end of the file.
static bool send_frame(const Robot* robot, FILE* file, const uint32_t size[2],
                       const double camera[4]) {
  int64_t stamp_ns;
  if (fread(&stamp_ns, sizeof stamp_ns, 1, file) != 1) return false;
  nav_msgs_msg_dds__Odometry_ odometry;
  memset(&odometry, 0, sizeof odometry);
  odometry.header = header(stamp_ns, "map");
  odometry.child_frame_id = "base";
  get(file, &odometry.pose.pose, 7 * sizeof(double));
  write_sample(robot->odometry, &odometry);

  const std_msgs_msg_dds__Header_ head = header(stamp_ns, "camera");
  sensor_msgs_msg_dds__CameraInfo_ info;
  memset(&info, 0, sizeof info);
  info.header = head;
  info.width = size[0];
  info.height = size[1];
  info.distortion_model = "plumb_bob";
  info.k[0] = camera[0], info.k[4] = camera[1], info.k[2] = camera[2], info.k[5] = camera[3];
  info.k[8] = 1.0;
  write_sample(robot->info, &info);

  const size_t pixels = (size_t)size[0] * size[1];
  uint8_t* buffer = malloc(pixels * 4);
  if (buffer == NULL) fail("no memory");
  get(file, buffer, pixels * 2);
  send_image(robot->labels, head, "mono16", size, 2, buffer);
  get(file, buffer, pixels * 4);
  send_image(robot->depth, head, "32FC1", size, 4, buffer);
  free(buffer);
  return true;
}

// ---- what a subscriber hears ----

// Which instances of a topic are alive. A reader that was not asked in time hears of a state and of
// the dispose after it in one sample, by its instance state.
typedef struct {
  dds_instance_handle_t* handles;
  size_t count, room;
} Alive;

typedef struct {
  dds_entity_t objects, events, tiles, deltas, manifest, lists, ros_events, ros_health;
  Alive objects_alive, tiles_alive;
  uint64_t version;
  uint32_t parts, listed;
  pocd_msgs_msg_dds__MapManifest_ last;
} Subscriber;

static dds_entity_t reader(dds_entity_t participant, const dds_topic_descriptor_t* type,
                           const char* name, bool latched) {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  // Every sample, so that no dispose takes the place of the sample before.
  dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
  const dds_entity_t topic =
      checked(dds_create_topic(participant, type, name, NULL, NULL), "no topic");
  const dds_entity_t result =
      checked(dds_create_reader(participant, topic, qos, NULL), "no reader");
  dds_delete_qos(qos);
  return result;
}

typedef void (*Handler)(Subscriber* self, const void* sample, const dds_sample_info_t* info);

static bool drain(Subscriber* self, dds_entity_t from, Handler handle) {
  void* samples[kBatch] = {NULL};
  dds_sample_info_t infos[kBatch];
  const int count = dds_take(from, samples, infos, kBatch, kBatch);
  if (count < 0) fail("cannot take samples");
  for (int i = 0; i < count; ++i) handle(self, samples[i], &infos[i]);
  if (count > 0) dds_return_loan(from, samples, count);
  return count > 0;
}

static size_t find_alive(const Alive* alive, dds_instance_handle_t handle) {
  size_t i = 0;
  while (i < alive->count && alive->handles[i] != handle) ++i;
  return i;
}

static void add_alive(Alive* alive, dds_instance_handle_t handle) {
  if (find_alive(alive, handle) < alive->count) return;
  if (alive->count == alive->room) {
    alive->room = alive->room == 0 ? 64 : 2 * alive->room;
    alive->handles = realloc(alive->handles, alive->room * sizeof *alive->handles);
    if (!alive->handles) fail("no memory");
  }
  alive->handles[alive->count++] = handle;
}

// False when it was not alive.
static bool remove_alive(Alive* alive, dds_instance_handle_t handle) {
  const size_t i = find_alive(alive, handle);
  if (i == alive->count) return false;
  alive->handles[i] = alive->handles[--alive->count];
  return true;
}

// 'p' present, 'd' disposed, 'w' lost its writers.
static char state_of(const dds_sample_info_t* info) {
  if (info->valid_data) return 'p';
  return info->instance_state == DDS_IST_NOT_ALIVE_DISPOSED ? 'd' : 'w';
}

static void put_object(char state, const pocd_msgs_msg_dds__ObjectState_* object, uint32_t id) {
  const char kind = 'O';
  PUT(kind), PUT(state);
  put(object->uuid, sizeof object->uuid);
  PUT(id);
}

static void on_object(Subscriber* self, const void* sample, const dds_sample_info_t* info) {
  const pocd_msgs_msg_dds__ObjectState_* object = sample;
  if (info->valid_data) {
    put_object('p', object, object->local_id);
    add_alive(&self->objects_alive, info->instance_handle);
  } else if (state_of(info) == 'w') {
    put_object('w', object, 0);
  }
  const bool disposed = info->instance_state == DDS_IST_NOT_ALIVE_DISPOSED;
  if (disposed && remove_alive(&self->objects_alive, info->instance_handle))
    put_object('d', object, 0);
}

static void on_event(Subscriber* self, const void* sample, const dds_sample_info_t* info) {
  (void)self;
  if (!info->valid_data) return;
  const pocd_msgs_msg_dds__ObjectEvent_* event = sample;
  const char kind = 'E';
  PUT(kind), PUT(event->kind), PUT(event->seq);
  put(event->uuid, sizeof event->uuid);
  PUT(event->evidence.after.mu);
}

static void put_payload(uint64_t version, const uint8_t* data, uint32_t size) {
  PUT(version), PUT(size);
  put(data, size);
}

static void put_tile(char state, const pocd_msgs_msg_dds__MapTile_* tile) {
  const char kind = 'T';
  PUT(kind), PUT(state), PUT(tile->x), PUT(tile->y), PUT(tile->z);
}

static void on_tile(Subscriber* self, const void* sample, const dds_sample_info_t* info) {
  const pocd_msgs_msg_dds__MapTile_* tile = sample;
  if (info->valid_data) {
    put_tile('p', tile);
    put_payload(tile->version, tile->payload._buffer, tile->payload._length);
    add_alive(&self->tiles_alive, info->instance_handle);
  } else if (state_of(info) == 'w') {
    put_tile('w', tile);
  }
  const bool disposed = info->instance_state == DDS_IST_NOT_ALIVE_DISPOSED;
  if (disposed && remove_alive(&self->tiles_alive, info->instance_handle)) put_tile('d', tile);
}

static void on_delta(Subscriber* self, const void* sample, const dds_sample_info_t* info) {
  if (!info->valid_data) return;
  const pocd_msgs_msg_dds__MapDelta_* delta = sample;
  const char kind = 'D';
  PUT(kind), PUT(delta->base_version), PUT(delta->version);
  PUT(delta->changed._length);
  for (uint32_t i = 0; i < delta->changed._length; ++i) {
    const pocd_msgs_msg_dds__TileData_* tile = &delta->changed._buffer[i];
    PUT(tile->key);
    put_payload(tile->version, tile->payload._buffer, tile->payload._length);
  }
  PUT(delta->removed._length);
  for (uint32_t i = 0; i < delta->removed._length; ++i) PUT(delta->removed._buffer[i]);
  PUT(delta->digest);
  self->parts = delta->part == 0 ? 1 : self->parts + 1;
  if (self->parts == delta->part_count) self->version = delta->version;
}

static void on_manifest(Subscriber* self, const void* sample, const dds_sample_info_t* info) {
  if (!info->valid_data) return;
  const pocd_msgs_msg_dds__MapManifest_* manifest = sample;
  const char kind = 'M';
  PUT(kind), PUT(manifest->version), PUT(manifest->digest);
  self->last = *manifest;
  self->last.frame_id = NULL;
}

// What a subscriber of ROS 2 gets: no keys, no disposes.
static void on_list(Subscriber* self, const void* sample, const dds_sample_info_t* info) {
  if (!info->valid_data) return;
  const pocd_interfaces_msg_dds__ObjectList_* list = sample;
  const char kind = 'L';
  PUT(kind), PUT(list->number);
  PUT(list->objects._length);
  for (uint32_t i = 0; i < list->objects._length; ++i) {
    put(list->objects._buffer[i].uuid, sizeof list->objects._buffer[i].uuid);
  }
  PUT(list->removed._length);
  for (uint32_t i = 0; i < list->removed._length; ++i) {
    put(list->removed._buffer[i].uuid, sizeof list->removed._buffer[i].uuid);
  }
  self->listed = list->objects._length;
}

static void on_ros_event(Subscriber* self, const void* sample, const dds_sample_info_t* info) {
  (void)self;
  if (!info->valid_data) return;
  const pocd_interfaces_msg_dds__ObjectEvent_* event = sample;
  const char kind = 'R';
  PUT(kind), PUT(event->seq), PUT(event->kind);
}

static void on_ros_health(Subscriber* self, const void* sample, const dds_sample_info_t* info) {
  (void)self;
  if (!info->valid_data) return;
  const pocd_interfaces_msg_dds__NodeHealth_* health = sample;
  const char kind = 'H';
  PUT(kind), PUT(health->epoch), PUT(health->frames_processed);
}

static bool converged(const Subscriber* self) {
  return self->last.final_version && self->version == self->last.version &&
         self->tiles_alive.count == self->last.tile_count &&
         self->objects_alive.count == self->last.object_count &&
         self->listed == self->last.object_count;
}

static void drain_all(Subscriber* self) {
  bool more = true;
  while (more) {
    more = drain(self, self->objects, on_object);
    more = drain(self, self->events, on_event) || more;
    more = drain(self, self->tiles, on_tile) || more;
    more = drain(self, self->deltas, on_delta) || more;
    more = drain(self, self->manifest, on_manifest) || more;
    more = drain(self, self->lists, on_list) || more;
    more = drain(self, self->ros_events, on_ros_event) || more;
    more = drain(self, self->ros_health, on_ros_health) || more;
  }
}

int main(int argc, char** argv) {
  if (argc != 4) fail("usage: cyclone_peer DOMAIN FRAMES LOG");
  signal(SIGTERM, on_signal);
  FILE* frames = fopen(argv[2], "rb");
  log_file = fopen(argv[3], "wb");
  if (frames == NULL || log_file == NULL) fail("cannot open the files");
  uint32_t size[2];
  double camera[4], mount[7];
  get(frames, size, sizeof size);
  get(frames, camera, sizeof camera);
  get(frames, mount, sizeof mount);

  const dds_entity_t bus =
      checked(dds_create_participant((dds_domainid_t)atoi(argv[1]), NULL, NULL), "no participant");
  Subscriber all;
  memset(&all, 0, sizeof all);
  all.objects = reader(bus, &pocd_msgs_msg_dds__ObjectState__desc, "pocd/objects", true);
  all.events = reader(bus, &pocd_msgs_msg_dds__ObjectEvent__desc, "pocd/object_events", false);
  all.tiles = reader(bus, &pocd_msgs_msg_dds__MapTile__desc, "pocd/map/tiles", true);
  all.deltas = reader(bus, &pocd_msgs_msg_dds__MapDelta__desc, "pocd/map/deltas", false);
  all.manifest = reader(bus, &pocd_msgs_msg_dds__MapManifest__desc, "pocd/map/manifest", true);
  all.lists = reader(bus, &pocd_interfaces_msg_dds__ObjectList__desc, "rt/pocd/objects", true);
  all.ros_events =
      reader(bus, &pocd_interfaces_msg_dds__ObjectEvent__desc, "rt/pocd/object_events", false);
  all.ros_health = reader(bus, &pocd_interfaces_msg_dds__NodeHealth__desc, "rt/pocd/health", true);
  Robot robot;
  robot.tf_static = writer(bus, &tf2_msgs_msg_dds__TFMessage__desc, "rt/tf_static", true);
  robot.odometry = writer(bus, &nav_msgs_msg_dds__Odometry__desc, "rt/robot1/odom", false);
  robot.info =
      writer(bus, &sensor_msgs_msg_dds__CameraInfo__desc, "rt/robot1/depth/camera_info", false);
  robot.labels = writer(bus, &sensor_msgs_msg_dds__Image__desc, "rt/robot1/segmentation", false);
  robot.depth = writer(bus, &sensor_msgs_msg_dds__Image__desc, "rt/robot1/depth/image_raw", false);

  const dds_entity_t writers[] = {robot.tf_static, robot.odometry, robot.info, robot.labels,
                                  robot.depth};
  const dds_entity_t readers[] = {all.objects,  all.events, all.tiles,      all.deltas,
                                  all.manifest, all.lists,  all.ros_events, all.ros_health};
  enum { kWriters = sizeof writers / sizeof *writers, kReaders = sizeof readers / sizeof *readers };
  for (int ready = 0; ready < kWriters + kReaders && !stopping; dds_sleepfor(DDS_MSECS(kPollMs))) {
    ready = 0;
    for (int i = 0; i < kWriters; ++i) ready += matched(writers[i]) > 0;
    for (int i = 0; i < kReaders; ++i) {
      dds_subscription_matched_status_t status;
      ready += dds_get_subscription_matched_status(readers[i], &status) == DDS_RETCODE_OK &&
               status.current_count > 0;
    }
  }
  fprintf(stderr, "matched\n");
  send_mount(&robot, mount);
  int sent = 0;
  while (!stopping && send_frame(&robot, frames, size, camera)) {
    for (int i = 0; i < kWriters; ++i) {
      while (!stopping && dds_wait_for_acks(writers[i], DDS_MSECS(200)) != DDS_RETCODE_OK) {
        drain_all(&all);
      }
    }
    drain_all(&all);
    ++sent;
  }
  fprintf(stderr, "sent %d frames\n", sent);
  for (bool said = false; !stopping; dds_sleepfor(DDS_MSECS(kPollMs))) {
    drain_all(&all);
    if (said || !converged(&all)) continue;
    const char kind = 'C';
    PUT(kind);
    fprintf(stderr, "converged\n");
    said = true;
  }
  drain_all(&all);
  fprintf(stderr, "holds version %llu of %llu%s, %lld of %lld tiles, %lld of %lld objects\n",
          (unsigned long long)all.version, (unsigned long long)all.last.version,
          all.last.final_version ? " (final)" : "", (long long)all.tiles_alive.count,
          (long long)all.last.tile_count, (long long)all.objects_alive.count,
          (long long)all.last.object_count);
  dds_delete(bus);
  free(all.objects_alive.handles);
  free(all.tiles_alive.handles);
  return fclose(log_file) == 0 ? 0 : 1;
}
