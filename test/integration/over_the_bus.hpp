// Fast DDS without its short cut within a process.
#pragma once

#include <fastrtps/xmlparser/XMLProfileManager.h>

namespace pocd {

/// Participants of one process talk as those of several do, from here on: Fast DDS would hand
/// samples over directly, past transports and flow control.
inline void talk_over_the_bus() {
  eprosima::fastrtps::LibrarySettingsAttributes settings;
  settings.intraprocess_delivery = eprosima::fastrtps::INTRAPROCESS_OFF;
  eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(settings);
}

}  // namespace pocd
