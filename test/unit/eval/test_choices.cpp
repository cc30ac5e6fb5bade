// Every parameter that is a word, in the files of the commands that evaluate.
#include <gtest/gtest.h>

#include "evaluation_methods.hpp"
#include "every_choice.hpp"
#include "pocd/eval/expected_changes.hpp"

namespace pocd {
namespace {

TEST(Choices, OfEvaluationFilesAreChecked) {
  EXPECT_EQ(test::try_every_choice<ExpectedChanges>(),
            (std::vector<std::string>{"changes[0].kind", "others"}));
  EXPECT_EQ(test::try_every_choice<VariantList>(), std::vector<std::string>{"variants[0].method"});
}

}  // namespace
}  // namespace pocd
