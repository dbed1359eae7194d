#include "proto/contract_breaks.h"

#include <utility>

namespace partiemc {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::FileDescriptor;
using google::protobuf::MethodDescriptor;
using google::protobuf::OneofDescriptor;
using google::protobuf::ServiceDescriptor;

std::string Name(const OneofDescriptor* oneof) { return oneof == nullptr ? "" : oneof->name(); }

// The type of a field in code and on the wire.
std::string TypeOf(const FieldDescriptor& field) {
  std::string type = field.type_name();
  if (field.message_type() != nullptr) type += " " + field.message_type()->full_name();
  if (field.enum_type() != nullptr) type += " " + field.enum_type()->full_name();
  if (field.is_repeated()) type = "repeated " + type;
  if (field.has_optional_keyword()) type = "optional " + type;
  return type;
}

class Comparison {
 public:
  void Files(const FileDescriptor& released, const FileDescriptor& now) {
    Same("package", released.package(), now.package());
    for (int k = 0; k < released.message_type_count(); ++k) {
      const Descriptor& message = *released.message_type(k);
      Found(message, now.FindMessageTypeByName(message.name()), &Comparison::Messages);
    }
    for (int k = 0; k < released.enum_type_count(); ++k) {
      const EnumDescriptor& type = *released.enum_type(k);
      Found(type, now.FindEnumTypeByName(type.name()), &Comparison::Enums);
    }
    for (int k = 0; k < released.service_count(); ++k) {
      const ServiceDescriptor& service = *released.service(k);
      Found(service, now.FindServiceByName(service.name()), &Comparison::Services);
    }
  }

  std::vector<std::string> breaks;

 private:
  void Same(const std::string& what, const std::string& released, const std::string& now) {
    if (released != now) breaks.push_back(what + ": was " + released + ", is " + now);
  }

  template <typename Part>
  void Found(const Part& released, const Part* now,
             void (Comparison::*compare)(const Part&, const Part&)) {
    if (now == nullptr) {
      breaks.push_back(released.full_name() + ": is gone");
    } else {
      (this->*compare)(released, *now);
    }
  }

  void Messages(const Descriptor& released, const Descriptor& now) {
    for (int k = 0; k < released.field_count(); ++k) Field(*released.field(k), now);
    for (int k = 0; k < released.reserved_range_count(); ++k) {
      const auto& range = *released.reserved_range(k);
      for (int number = range.start; number < range.end; ++number) {
        if (!now.IsReservedNumber(number)) {
          breaks.push_back(now.full_name() + ": " + std::to_string(number) +
                           " is not reserved any more");
        }
      }
    }
    for (int k = 0; k < released.nested_type_count(); ++k) {
      const Descriptor& nested = *released.nested_type(k);
      Found(nested, now.FindNestedTypeByName(nested.name()), &Comparison::Messages);
    }
    for (int k = 0; k < released.enum_type_count(); ++k) {
      const EnumDescriptor& nested = *released.enum_type(k);
      Found(nested, now.FindEnumTypeByName(nested.name()), &Comparison::Enums);
    }
  }

  void Field(const FieldDescriptor& released, const Descriptor& message) {
    const FieldDescriptor* now = message.FindFieldByNumber(released.number());
    const std::string& name = released.full_name();
    if (now == nullptr) {
      breaks.push_back(name + ": is gone");
      return;
    }
    Same(name + ": name", released.name(), now->name());
    Same(name + ": name in JSON", released.json_name(), now->json_name());
    Same(name + ": type", TypeOf(released), TypeOf(*now));
    Same(name + ": oneof", Name(released.real_containing_oneof()),
         Name(now->real_containing_oneof()));
  }

  void Enums(const EnumDescriptor& released, const EnumDescriptor& now) {
    for (int k = 0; k < released.value_count(); ++k) {
      const auto& value = *released.value(k);
      const auto* found = now.FindValueByName(value.name());
      Same(value.full_name() + ": number", std::to_string(value.number()),
           found == nullptr ? "gone" : std::to_string(found->number()));
    }
  }

  void Services(const ServiceDescriptor& released, const ServiceDescriptor& now) {
    for (int k = 0; k < released.method_count(); ++k) {
      const MethodDescriptor& method = *released.method(k);
      Found(method, now.FindMethodByName(method.name()), &Comparison::Methods);
    }
  }

  void Methods(const MethodDescriptor& released, const MethodDescriptor& now) {
    const auto signature = [](const MethodDescriptor& method) {
      return (method.client_streaming() ? "stream " : "") + method.input_type()->full_name() +
             " -> " + (method.server_streaming() ? "stream " : "") +
             method.output_type()->full_name();
    };
    Same(released.full_name(), signature(released), signature(now));
  }
};

}  // namespace

std::vector<std::string> ContractBreaks(const FileDescriptor& released, const FileDescriptor& now) {
  Comparison comparison;
  comparison.Files(released, now);
  return std::move(comparison.breaks);
}

}  // namespace partiemc
