#include <examples/service/s3_storage.hpp>

#include <catch2/catch.hpp>
#include <tests/support/files.hpp>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

using ldi::examples::s3_storage;

namespace {

/// Listens on a free port of this machine, and responds to one request.
class server_for_one_request {
public:
    server_for_one_request() : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
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
        constexpr std::string_view answer = "HTTP/1.1 200 OK\r\nContent-Length: 2\r\nConnection: close\r\n\r\nok";
        static_cast<void>(::write(connection, answer.data(), answer.size()));
        ::close(connection);
        return request;
    }

private:
    int socket_, port_ = 0;
};

/// Gets an object from an S3 server that runs in this test, and returns the request.
std::string request_with(const char* session_token) {
    const server_for_one_request server;
    ::setenv("AWS_ENDPOINT_URL", server.address().c_str(), 1);
    ::setenv("AWS_ACCESS_KEY_ID", "id", 1), ::setenv("AWS_SECRET_ACCESS_KEY", "secret", 1);
    ::setenv("no_proxy", "127.0.0.1", 1);
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
