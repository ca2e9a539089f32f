// Owning pointers for OpenSSL objects.
#pragma once

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <openssl/x509_vfy.h>

#include <memory>
#include <string>

namespace perdure::bus {

template <auto free>
struct Freed {
  template <class T>
  void operator()(T* pointer) const {
    free(pointer);
  }
};
inline void freeBio(BIO* bio) { BIO_free_all(bio); }

using Certificate = std::unique_ptr<X509, Freed<X509_free>>;
using RevokedList = std::unique_ptr<X509_CRL, Freed<X509_CRL_free>>;
using Key = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY_free>>;
using Bio = std::unique_ptr<BIO, Freed<freeBio>>;

/// Returns nullptr if the file is not a readable PEM certificate.
inline Certificate readCertificate(const std::string& path) {
  const Bio file(BIO_new_file(path.c_str(), "r"));
  return Certificate(file ? PEM_read_bio_X509(file.get(), nullptr, nullptr, nullptr) : nullptr);
}
inline RevokedList readRevokedList(const std::string& path) {
  const Bio file(BIO_new_file(path.c_str(), "r"));
  return RevokedList(file ? PEM_read_bio_X509_CRL(file.get(), nullptr, nullptr, nullptr) : nullptr);
}
inline Key readKey(const std::string& path) {
  const Bio file(BIO_new_file(path.c_str(), "r"));
  return Key(file ? PEM_read_bio_PrivateKey(file.get(), nullptr, nullptr, nullptr) : nullptr);
}

}  // namespace perdure::bus
