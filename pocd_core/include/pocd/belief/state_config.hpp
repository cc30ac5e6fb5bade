// Parameters of an object's belief and life cycle.
#pragma once

#include "pocd/common/describe.hpp"

namespace pocd {

struct StateConfig {
  double initial_stationarity = 0.67;
  double initial_count = 3.0;
  double initial_sigma_m = 0.5;
  double max_stationarity = 0.9999;
  double max_count = 12.0;
  double min_sigma_share = 0.5;
  double remove_below = 0.4;
  double k = 3.0;
  int confirm_observations = 3;
  int tentative_frames = 15;
  int erode_frames = 5;
  int wait_for_doubt_frames = 6;
  int merge_frames = 10;
  double visit_gap_s = 5.0;
  double moment_s = 0.1;
  double relocation_window_s = 60.0;
  double relocation_reach_m = 1.5;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("initial_stationarity", initial_stationarity, Range{0.01, 0.99}, "E[v] of a new object.");
    visit("initial_count", initial_count, Range{0.1, 1000.0}, "alpha + beta of a new object.");
    visit("initial_sigma_m", initial_sigma_m, Range{0.001, 100.0}, "sigma of a new object [m].");
    visit("max_stationarity", max_stationarity, Range{0.5, 1.0},
          "An update that would raise E[v] above this leaves it as it is, v_max.");
    visit("max_count", max_count, Range{1.0, 1e6},
          "Cap of alpha + beta: how much past evidence an object can hold against new evidence.");
    visit(
        "min_sigma_share", min_sigma_share, Range{0.0, 10.0},
        "Floor of sigma as a share of tau: how far past measurements can fix the believed change.");
    visit("remove_below", remove_below, Range{0.0, 1.0},
          "Objects with E[v] below this are removed from library and map, theta_stat.");
    visit(
        "k", k, Range{0.0, 100.0},
        "Weight of the stationarity class where it supports the measurement: movable objects that "
        "changed, static ones that did not.");
    visit("confirm_observations", confirm_observations, Range{1, 1000},
          "Observations before a new object is reported as ADDED.");
    visit("tentative_frames", tentative_frames, Range{1, 100000},
          "A new object that is in view this many frames without being seen is forgotten "
          "[frames].");
    visit("erode_frames", erode_frames, Range{0, 250},
          "A point of an object that is seen through in this many frames in a row is dropped "
          "[frames]; 0: never.");
    visit("wait_for_doubt_frames", wait_for_doubt_frames, Range{0, 100000},
          "How much longer the report of a new object waits while a like one is seen through or "
          "found "
          "displaced: both are one MOVED then [frames].");
    visit("merge_frames", merge_frames, Range{1, 100000},
          "Objects of one class that share an observation in this many frames are one [frames].");
    visit(
        "visit_gap_s", visit_gap_s, Range{0.0, 1e6},
        "When nobody was near an object for this time, the next look is a new visit: what was seen "
        "of the space between it and its neighbours is complete, its sides are joined, and looks "
        "in a row end [s].");
    visit(
        "moment_s", moment_s, Range{0.0, 10.0},
        "Looks of several robots at one object within this time are one measurement: the one that "
        "saw most of the object counts. Looks in a row that find it gone or displaced must last "
        "for longer [s].");
    visit("relocation_window_s", relocation_window_s, Range{0.0, 1e6},
          "A removed object and a new one of its class are one MOVED within this time, when their "
          "surfaces align [s].");
    visit("relocation_reach_m", relocation_reach_m, Range{0.0, 1e6},
          "Longest way on which what departed is found again as MOVED; what went farther is "
          "REMOVED and "
          "ADDED [m].");
  }
};

}  // namespace pocd
