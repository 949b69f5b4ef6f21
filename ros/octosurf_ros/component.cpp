// The mapping node as a component of ROS 2.
#include "node/node.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstring>
#include <memory>
#include <octosurf_msgs/srv/changes.hpp>
#include <octosurf_msgs/srv/clear.hpp>
#include <octosurf_msgs/srv/contact_regions.hpp>
#include <octosurf_msgs/srv/load.hpp>
#include <octosurf_msgs/srv/plan.hpp>
#include <octosurf_msgs/srv/publish.hpp>
#include <octosurf_msgs/srv/query.hpp>
#include <octosurf_msgs/srv/save.hpp>
#include <optional>
#include <rclcpp/rclcpp.hpp>
#include <rclcpp/serialization.hpp>
#include <rclcpp_components/register_node_macro.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace octosurf::ros {
namespace {

using node::Profile;
using node::RawMessage;
using node::Request;
using Serialized = std::shared_ptr<rclcpp::SerializedMessage>;

rclcpp::QoS qos_of(Profile profile, int depth) {
  rclcpp::QoS qos{rclcpp::KeepLast(static_cast<std::size_t>(depth))};
  if (profile == Profile::sensor) qos.best_effort();
  if (profile == Profile::latched) qos.transient_local();
  return qos;
}

/// "sensor_msgs/Image" → "sensor_msgs/msg/Image"
std::string full_name(std::string type) { return type.insert(type.find('/'), "/msg"); }

Serialized serialized(const std::string& cdr) {
  auto message = std::make_shared<rclcpp::SerializedMessage>(cdr.size());
  rcl_serialized_message_t& raw = message->get_rcl_serialized_message();
  std::memcpy(raw.buffer, cdr.data(), cdr.size());
  raw.buffer_length = cdr.size();
  return message;
}

RawMessage raw_of(Serialized message, std::int64_t sent_ns) {
  const rcl_serialized_message_t& raw = message->get_rcl_serialized_message();
  return {{reinterpret_cast<const char*>(raw.buffer), raw.buffer_length}, std::move(message), sent_ns};
}

class RosPublisher final : public node::Publisher {
 public:
  explicit RosPublisher(rclcpp::GenericPublisher::SharedPtr publisher) : publisher_(std::move(publisher)) {}
  bool publish(std::string cdr) override {
    publisher_->publish(*serialized(cdr));
    return true;
  }
  std::size_t subscribers() const override { return publisher_->get_subscription_count(); }

 private:
  rclcpp::GenericPublisher::SharedPtr publisher_;
};

class RosSubscription final : public node::Subscription {
 public:
  struct Events {
    std::atomic<std::size_t> lost{0};
    std::atomic<int> mismatched{RMW_QOS_POLICY_INVALID};
  };
  RosSubscription(rclcpp::GenericSubscription::SharedPtr subscription, std::shared_ptr<Events> events)
      : subscription_(std::move(subscription)), events_(std::move(events)) {}
  std::size_t lost() const override { return events_->lost; }
  std::size_t publishers() const override { return subscription_->get_publisher_count(); }
  std::string mismatch() const override {
    const int policy = events_->mismatched;
    if (policy == RMW_QOS_POLICY_INVALID) return {};
    return policy == RMW_QOS_POLICY_RELIABILITY  ? "reliability"
           : policy == RMW_QOS_POLICY_DURABILITY ? "durability"
                                                 : "policy " + std::to_string(policy);
  }

 private:
  rclcpp::GenericSubscription::SharedPtr subscription_;
  std::shared_ptr<Events> events_;
};

class RosMiddleware final : public node::Middleware {
 public:
  explicit RosMiddleware(rclcpp::Node& node)
      : node_(node), one_by_one_(node.create_callback_group(rclcpp::CallbackGroupType::MutuallyExclusive)) {}

  std::unique_ptr<node::Publisher> advertise(const std::string& topic, const std::string& type,
                                             Profile profile) override {
    return std::make_unique<RosPublisher>(
        node_.create_generic_publisher(topic, full_name(type), qos_of(profile, 1)));
  }

  std::unique_ptr<node::Subscription> subscribe(const std::string& topic, const std::string& type,
                                                Profile profile, int depth,
                                                std::function<void(RawMessage)> receive) override {
    auto events = std::make_shared<RosSubscription::Events>();
    rclcpp::SubscriptionOptions options;
    options.callback_group = one_by_one_;
    options.event_callbacks.incompatible_qos_callback =
        [events](rclcpp::QOSRequestedIncompatibleQoSInfo& info) {
          events->mismatched = info.last_policy_kind;
        };
    options.event_callbacks.message_lost_callback = [events](rclcpp::QOSMessageLostInfo& info) {
      events->lost = info.total_count;
    };
    const auto take = [this, receive = std::move(receive)](Serialized message) {
      receive(raw_of(std::move(message), node_.now().nanoseconds()));
    };
    const auto subscribe_with = [&] {
      return node_.create_generic_subscription(topic, full_name(type), qos_of(profile, depth), take, options);
    };
    rclcpp::GenericSubscription::SharedPtr subscription;
    try {
      subscription = subscribe_with();
    } catch (const rclcpp::UnsupportedEventTypeException&) {  // not every middleware counts what was lost
      options.event_callbacks.message_lost_callback = {};
      subscription = subscribe_with();
    }
    return std::make_unique<RosSubscription>(std::move(subscription), std::move(events));
  }

  std::shared_ptr<void> serve(const std::string& name, const std::string& type,
                              std::function<void(Request)> receive) override {
    namespace srv = octosurf_msgs::srv;
    if (type == "Save") return serve_as<srv::Save>(name, std::move(receive));
    if (type == "Load") return serve_as<srv::Load>(name, std::move(receive));
    if (type == "Query") return serve_as<srv::Query>(name, std::move(receive));
    if (type == "ContactRegions") return serve_as<srv::ContactRegions>(name, std::move(receive));
    if (type == "Plan") return serve_as<srv::Plan>(name, std::move(receive));
    if (type == "Changes") return serve_as<srv::Changes>(name, std::move(receive));
    if (type == "Publish") return serve_as<srv::Publish>(name, std::move(receive));
    if (type == "Clear") return serve_as<srv::Clear>(name, std::move(receive));
    throw std::logic_error("no service is of type " + type);
  }

 private:
  template <class Service>
  std::shared_ptr<void> serve_as(const std::string& name, std::function<void(Request)> receive) {
    using ToClient = std::shared_ptr<rclcpp::Service<Service>>;
    const auto take = [receive = std::move(receive)](ToClient service, std::shared_ptr<rmw_request_id_t> id,
                                                     std::shared_ptr<typename Service::Request> request) {
      auto message = std::make_shared<rclcpp::SerializedMessage>();
      rclcpp::Serialization<typename Service::Request>().serialize_message(request.get(), message.get());
      receive({raw_of(std::move(message), 0), [service, id](const std::string& cdr) {
                 typename Service::Response response;
                 rclcpp::Serialization<typename Service::Response>().deserialize_message(
                     serialized(cdr).get(), &response);
                 service->send_response(*id, response);
               }});
    };
    return node_.create_service<Service>(name, take);
  }

  rclcpp::Node& node_;
  rclcpp::CallbackGroup::SharedPtr one_by_one_;
};

/// What a parameter has, as words of a command line.
std::vector<std::string> words_of(const rclcpp::Parameter& parameter) {
  if (parameter.get_type() == rclcpp::ParameterType::PARAMETER_STRING_ARRAY)
    return parameter.as_string_array();
  if (parameter.get_type() == rclcpp::ParameterType::PARAMETER_STRING) return {parameter.as_string()};
  return {parameter.value_to_string()};
}

}  // namespace

/// Declares each flag of octosurf-dds but --domain as a parameter of its name, with _ for -, read once.
class MappingNode : public rclcpp::Node {
 public:
  explicit MappingNode(const rclcpp::NodeOptions& options) : Node("octosurf", options), middleware_(*this) {
    settings_.name = get_fully_qualified_name();
    read_parameters();
    node_.emplace(middleware_, settings_);
    RCLCPP_INFO(get_logger(), "mapping %s", settings_.scans().c_str());
    watch_ = create_wall_timer(std::chrono::milliseconds(500), [this] {
      if (node_ && node_->failed()) rclcpp::shutdown(nullptr, "mapping has failed");
    });
  }

  ~MappingNode() override {
    // `ros2 launch` ends what has not ended 10 s after Ctrl-C; saving needs most of it.
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(3);
    try {
      const std::string line = node_->finish([end] { return std::chrono::steady_clock::now() > end; });
      RCLCPP_INFO(get_logger(), "%s", line.c_str());
    } catch (const std::exception& error) {
      RCLCPP_FATAL(get_logger(), "%s", error.what());
    }
  }

 private:
  void read_parameters() {
    CLI::App app;
    node::add_options(app, settings_);
    std::vector<std::string> words;
    for (const CLI::Option* option : app.get_options()) {
      const std::string flag = option->get_lnames().front();
      if (flag == "help" || flag == "name") continue;
      std::string name = flag;
      std::replace(name.begin(), name.end(), '-', '_');
      rcl_interfaces::msg::ParameterDescriptor descriptor;
      descriptor.description = option->get_description();
      descriptor.read_only = descriptor.dynamic_typing = true;
      const bool is_flag = option->get_items_expected_max() == 0;
      const rclcpp::ParameterValue usual =
          is_flag ? rclcpp::ParameterValue(false) : rclcpp::ParameterValue(option->get_default_str());
      declare_parameter(name, usual, descriptor);
      const rclcpp::Parameter parameter = get_parameter(name);
      const std::vector<std::string> values = words_of(parameter);
      if (is_flag && values != std::vector<std::string>{"true"}) continue;
      if (!is_flag && (values == std::vector<std::string>{option->get_default_str()} || values.empty() ||
                       values == std::vector<std::string>{""}))
        continue;
      words.push_back("--" + flag);
      if (!is_flag) words.insert(words.end(), values.begin(), values.end());
    }
    std::reverse(words.begin(), words.end());  // as CLI11 takes them
    try {
      app.parse(std::move(words));
    } catch (const CLI::ParseError& error) {
      throw std::invalid_argument(std::string("parameters: ") + error.what());
    }
  }

  node::NodeOptions settings_;
  RosMiddleware middleware_;
  std::optional<node::Node> node_;
  rclcpp::TimerBase::SharedPtr watch_;
};

}  // namespace octosurf::ros

RCLCPP_COMPONENTS_REGISTER_NODE(octosurf::ros::MappingNode)
