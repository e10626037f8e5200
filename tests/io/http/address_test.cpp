#include "io/http/address.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "io/errors/errors.h"
#include "io/http/answer.h"
#include "io/text/addresses.h"

namespace tagrid {
namespace {

TEST(Address, OnlyThreeSchemesAreAddresses) {
  for (const char* text : {"http://a/b", "https://a/b", "HTTPS://a", "s3://bucket/key"})
    EXPECT_TRUE(is_address(text)) << text;
  for (const char* text :
       {"a.tag", "-", "", "http:/a", "http:", "./http://a", "file:///a", "ftp://a/b", "s3:", "dir/http://a"})
    EXPECT_FALSE(is_address(text)) << text;
}

TEST(Address, OtherSchemesAreSeen) {
  for (const char* text : {"gs://a/b", "az://a", "http:/a", "FILE:///a", "git+ssh://a", "s3://a/b", "a:/"})
    EXPECT_TRUE(has_scheme(text)) << text;
  for (const char* text : {"", ":/", "://a", "a:b", "a", "./gs://a", "d/gs://a", "1a:/b", "a b:/c"})
    EXPECT_FALSE(has_scheme(text)) << text;
}

TEST(Address, MessagesHaveNoSecrets) {
  const std::pair<const char*, const char*> cases[] = {
      {"https://host/a.tag", "https://host/a.tag"},
      {"HTTPS://host:8080/a%20b.tag", "https://host:8080/a%20b.tag"},
      {"https://user:secret@host/a.tag", "https://host/a.tag"},
      {"https://user:s@cret@host/a.tag", "https://host/a.tag"},
      {"https://user@host/a@b.tag", "https://host/a@b.tag"},
      {"https://host/a@b.tag", "https://host/a@b.tag"},
      {"https://host:80/a@b.tag", "https://host:80/a@b.tag"},
      {"https://user:se/cret@host/a.tag", "https://host/a.tag"},
      {"https://host/a.tag?X-Amz-Signature=abc", "https://host/a.tag"},
      {"https://host?key=abc", "https://host"},
      {"https://user:a?b@host/x", "https://host/x"},
      {"https://host:80/a?mail=a@b", "https://host:80/a"},
      {"https://[::1]:80/a", "https://[::1]:80/a"},
      {"https://[::1]/a@b", "https://[::1]/a@b"},
      {"https://host/a.tag#part", "https://host/a.tag"},
      {"s3://bucket/a@b?c", "s3://bucket/a@b?c"},
      {"s3://key:secret@bucket/k", "s3://bucket/k"},
      {"s3://key:sec/ret@bucket/k", "s3://bucket/k"},
      {"s3://bucket/k?X-Amz-Signature=abc", "s3://bucket/k"},
      {"gs://bucket/x.tag?X-Goog-Signature=SECRET", "gs://bucket/x.tag"},
      {"ftp://ann:PW@host/x.tag", "ftp://host/x.tag"},
      {"sftp://ann:P/W@host/x.tag", "sftp://host/x.tag"},
      {"AZ://container/x.tag?sig=SECRET", "az://container/x.tag"},
      {"http:/ann:pw@host/x.tag?s", "http:/host/x.tag"},
      {"git+ssh://ann@host/x", "git+ssh://host/x"},
      {"file:///home/a@b.tag", "file:///home/a@b.tag"},
      {"file:///", "file:///"},
      {"dir/gs://a?b", "dir/gs://a?b"},
      {"2x:/a?b", "2x:/a?b"},
      {"a:b?c", "a:b?c"},
      {"scan@2x?.tag", "scan@2x?.tag"}};
  for (const auto& [text, shown] : cases) EXPECT_EQ(shown_address(text), shown);
}

class ObjectAddress : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY", "AWS_SESSION_TOKEN", "AWS_REGION",
                             "AWS_DEFAULT_REGION", "AWS_ENDPOINT_URL", "AWS_ENDPOINT_URL_S3"})
      unsetenv(name);
  }
};

TEST_F(ObjectAddress, BucketsAreHostsWhereTheirNamesFitACertificate) {
  EXPECT_EQ(address_of("s3://bucket/a/b c.tag").url, "https://bucket.s3.us-east-1.amazonaws.com/a/b%20c.tag");
  setenv("AWS_DEFAULT_REGION", "eu-west-1", 1);
  EXPECT_EQ(address_of("s3://my.bucket/k").url, "https://s3.eu-west-1.amazonaws.com/my.bucket/k");
  setenv("AWS_REGION", "eu-west-2", 1);
  EXPECT_EQ(address_of("s3://bucket/k").region, "eu-west-2");
}

// Keys are no paths: the server is asked for what they are.
TEST_F(ObjectAddress, KeysKeepTheirBytes) {
  setenv("AWS_ENDPOINT_URL", "http://minio", 1);
  const std::pair<const char*, const char*> cases[] = {{"a/../b", "a/../b"},
                                                       {"../other/x", "../other/x"},
                                                       {"./a", "./a"},
                                                       {"a//b", "a//b"},
                                                       {"/a", "/a"},
                                                       {"%2e%2e/a", "%252e%252e/a"},
                                                       {"a?b=c#d", "a%3Fb%3Dc%23d"},
                                                       {"100%", "100%25"},
                                                       {"a b", "a%20b"},
                                                       {"\xE2\x82\xAC", "%E2%82%AC"},
                                                       {"a/", "a/"},
                                                       {"~-_.", "~-_."}};
  for (const auto& [key, path] : cases)
    EXPECT_EQ(address_of(std::string("s3://bucket/") + key).url, std::string("http://minio/bucket/") + path);
}

TEST_F(ObjectAddress, AnotherServerHasBucketsInItsPaths) {
  setenv("AWS_ENDPOINT_URL", "http://minio:9000/", 1);
  EXPECT_EQ(address_of("s3://bucket/\xC3\xA4+b").url, "http://minio:9000/bucket/%C3%A4%2Bb");
  setenv("AWS_ENDPOINT_URL_S3", "https://s3.example/x", 1);
  EXPECT_EQ(address_of("s3://bucket/k").url, "https://s3.example/x/bucket/k");
  for (const char* wrong : {"minio:9000", "file:///", "s3://a/b", "http://minio/?x=", "http://minio/#"}) {
    setenv("AWS_ENDPOINT_URL_S3", wrong, 1);
    EXPECT_THROW(address_of("s3://bucket/k"), UsageError);
  }
}

TEST_F(ObjectAddress, WhatIsNoBucketOrHasHalfOfTheKeysIsRefused) {
  for (const char* text : {"s3://", "s3://bucket", "s3://bucket/", "s3://a/k", "s3://user:x@host/k",
                           "s3:///k", "s3://../host/k", "s3://.../k", "s3://a..b/k", "s3://.ab/k",
                           "s3://ab-/k", "s3://a%2e/k", "s3://host/k?X-Amz-Signature=x"})
    EXPECT_THROW(address_of(text), UsageError) << text;
  setenv("AWS_ACCESS_KEY_ID", "key", 1);
  EXPECT_THROW(address_of("s3://bucket/k"), UsageError);
}

TEST(ContentRange, IsReadExactly) {
  const auto range = content_range_of("bytes 5-9/20");
  ASSERT_TRUE(range);
  EXPECT_EQ(range->first, 5u);
  EXPECT_EQ(range->last, 9u);
  EXPECT_EQ(range->size, 20u);
  EXPECT_FALSE(content_range_of("bytes 5-9/*")->size);
  EXPECT_FALSE(content_range_of("Bytes */20")->first);
  EXPECT_EQ(content_range_of("bytes */20")->size, 20u);
  for (const char* wrong :
       {"", "bytes", "bytes ", "bytes 5-9", "bytes 9-5/20", "bytes 5-20/20", "bytes -1-9/20", "bytes 5-/20",
        "bytes 5-9/x", "bytes 5-9/-1", "items 5-9/20", "bytes 5-9/99999999999999999999", "bytes 0x5-9/20"})
    EXPECT_FALSE(content_range_of(wrong)) << wrong;
}

}  // namespace
}  // namespace tagrid
