#include <examples/service/s3_storage.hpp>

#include <catch2/catch.hpp>
#include <tests/support/files.hpp>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <optional>
#include <string>
#include <thread>
#include <utility>

using ldi::error_code;
using ldi::examples::s3_storage;
using ldi::testing::raised;

namespace {

/// Listens on a free port of this machine, and responds to one request.
class server_for_one_request {
public:
    explicit server_for_one_request(std::string status = "200 OK", std::string body = "ok")
        : server_for_one_request(status, body, body.size()) {}

    /// length  size of the body according to the headers
    server_for_one_request(const std::string& status, const std::string& body, std::size_t length)
        : answer_("HTTP/1.1 " + status + "\r\nContent-Length: " + std::to_string(length) + "\r\nConnection: close\r\n\r\n" +
                  body),
          socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
        sockaddr_in at{};
        at.sin_family = AF_INET, at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t size = sizeof at;
        REQUIRE(::bind(socket_, reinterpret_cast<const sockaddr*>(&at), size) == 0);
        REQUIRE(::listen(socket_, 1) == 0);
        REQUIRE(::getsockname(socket_, reinterpret_cast<sockaddr*>(&at), &size) == 0);
        port_ = ntohs(at.sin_port);
    }
    ~server_for_one_request() { ::close(socket_); }
    server_for_one_request(const server_for_one_request&) = delete;
    server_for_one_request& operator=(const server_for_one_request&) = delete;

    std::string address() const { return "http://127.0.0.1:" + std::to_string(port_); }

    /// Waits for a request, sends a fixed response, and returns the request line and the headers.
    std::string serve() const {
        const int connection = ::accept(socket_, nullptr, nullptr);
        std::string request;
        for (char part[1024]; request.find("\r\n\r\n") == std::string::npos;) {
            const ssize_t count = ::read(connection, part, sizeof part);
            if (count <= 0) break;
            request.append(part, static_cast<std::size_t>(count));
        }
        static_cast<void>(
            ::send(connection, answer_.data(), answer_.size(), MSG_NOSIGNAL));  // the client may have enough earlier
        ::close(connection);
        return request;
    }

private:
    std::string answer_;
    int socket_, port_ = 0;
};

/// Sets the environment of s3_storage.
void use(const server_for_one_request& server) {
    ::setenv("AWS_ENDPOINT_URL", server.address().c_str(), 1);
    ::setenv("AWS_ACCESS_KEY_ID", "id", 1), ::setenv("AWS_SECRET_ACCESS_KEY", "secret", 1);
    ::setenv("no_proxy", "127.0.0.1", 1);
}

/// Gets an object from an S3 server that runs in this test, and returns the request.
std::string request_with(const char* session_token) {
    const server_for_one_request server;
    use(server);
    if (session_token == nullptr)
        ::unsetenv("AWS_SESSION_TOKEN");
    else
        ::setenv("AWS_SESSION_TOKEN", session_token, 1);
    std::string request;
    std::thread serving([&] { request = server.serve(); });
    const auto bytes = s3_storage("s3://bucket/in").get("a.jpg", 10);
    serving.join();
    CHECK(bytes == ldi::testing::bytes_of("ok"));
    CHECK(request.starts_with("GET /bucket/in/a.jpg HTTP/1.1\r\n"));
    return request;
}

/// Gets an object of at most 100 bytes from a server with the given response. Returns the code of the error, or nothing.
std::optional<error_code> failure_of(const std::string& status, const std::string& body) {
    const server_for_one_request server(status, body);
    use(server);
    std::thread serving([&] { server.serve(); });
    std::optional<error_code> code;
    try {
        s3_storage("s3://bucket/in").get("a.jpg", 100);
    } catch (const ldi::error& failed) {
        code = failed.code();
    }
    serving.join();
    return code;
}

/// Names of the signed headers, with a semicolon after each.
std::string signed_headers(const std::string& request) {
    const std::size_t begin = request.find("SignedHeaders=");
    REQUIRE(begin != std::string::npos);
    return request.substr(begin + 14, request.find(',', begin) - begin - 14) + ";";
}

}  // namespace

TEST_CASE("requests to S3 contain the session token of temporary credentials, and sign it") {
    const std::string with = request_with("a+token/1=="), without = request_with(nullptr);
    CHECK_THAT(with, Catch::Contains("\r\nx-amz-security-token: a+token/1==\r\n", Catch::CaseSensitive::No));
    CHECK_THAT(signed_headers(with), Catch::Contains("x-amz-security-token;") && Catch::Contains("x-amz-content-sha256;"));
    CHECK_THAT(without, !Catch::Contains("security-token"));
    CHECK_THAT(signed_headers(without), Catch::Contains("x-amz-content-sha256;"));
    CHECK_THAT(request_with(""), !Catch::Contains("security-token"));
}

TEST_CASE(
    "only an S3 server that has no such object causes an error of the photo; all other responses but success can be tried "
    "again") {
    const std::string none = "<Error><Code>NoSuchKey</Code></Error>", page(1000, ' ');
    CHECK(failure_of("200 OK", "photo") == std::nullopt);
    CHECK(failure_of("200 OK", page) == error_code::too_large);
    CHECK(failure_of("404 Not Found", none) == error_code::file_access);
    CHECK(failure_of("404 Not Found", "<Error><Code>NoSuchBucket</Code></Error>") == error_code::unavailable);
    for (const char* const status : {"403 Forbidden", "404 Not Found", "500 Internal Server Error", "503 Slow Down"}) {
        CAPTURE(status);
        CHECK(failure_of(status, "") == error_code::unavailable);
        CHECK(failure_of(status, page) == error_code::unavailable);  // larger than the object may be
    }
}

TEST_CASE("a transfer fails soon after the worker should end") {
    const server_for_one_request silent;  // accepts the connection, and never responds
    use(silent);
    std::atomic<bool> is_ending{false};
    std::thread ending([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(200));
        is_ending = true;
    });
    const auto begun = std::chrono::steady_clock::now();
    CHECK(raised([&] { s3_storage("s3://bucket/in", &is_ending, std::chrono::milliseconds(100)).get("a.jpg", 100); }) ==
          error_code::unavailable);
    CHECK(std::chrono::steady_clock::now() - begun < std::chrono::seconds(8));  // a stalled transfer lasts 10 seconds
    ending.join();
}

TEST_CASE("an object that is too large is refused before its body arrives") {
    const server_for_one_request server("200 OK", "",
                                        1'000'000'000);  // sends no body, which otherwise is an interrupted transfer
    use(server);
    std::thread serving([&] { server.serve(); });
    CHECK(raised([&] { s3_storage("s3://bucket/in").get("a.jpg", 1'000'000); }) == error_code::too_large);
    serving.join();
}

TEST_CASE("a download reserves the memory of the whole object at once") {
    const server_for_one_request server("200 OK", std::string(200'000, 'x'));
    use(server);
    std::thread serving([&] { server.serve(); });
    const auto found = s3_storage("s3://bucket/in").find("a.jpg", 1'000'000);
    serving.join();
    REQUIRE(found);
    CHECK(found->size() == 200'000);
    CHECK(found->capacity() == 200'000);
}

TEST_CASE("find() returns nothing if an S3 server has no such object") {
    const server_for_one_request server("404 Not Found", "<Error><Code>NoSuchKey</Code></Error>");
    use(server);
    std::thread serving([&] { server.serve(); });
    const auto found = s3_storage("s3://bucket/in").find("a.jpg", 100);
    serving.join();
    CHECK(!found);
}
