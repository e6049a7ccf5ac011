# What BradleyTerry2 1.1-2 (R 4.2.2, brglm 0.7.2) answers for position bias and bias reduction:
# Rscript make_bradley_terry2.R > bradley_terry2.json. The counts are invented.
suppressMessages(library(BradleyTerry2))
show <- function(x) paste0("[", paste(sprintf("%.12g", x), collapse = ", "), "]")
entries <- c()

# left, right, times the left was chosen, times the right was chosen
sided <- matrix(c(1,2,4,5, 2,1,8,1, 1,3,3,6, 3,1,8,1, 1,4,2,7, 4,1,9,0,
                  2,3,6,3, 3,2,6,3, 2,4,1,8, 4,2,9,0, 3,4,2,7, 4,3,9,0), ncol = 4, byrow = TRUE)
ids <- paste0("c", 1:4)
left <- data.frame(id = factor(ids[sided[, 1]], ids), at = 1)
right <- data.frame(id = factor(ids[sided[, 2]], ids), at = 0)
for (link in c("probit", "logit")) {
  fit <- BTm(cbind(sided[, 3], sided[, 4]), left, right, ~ id + at, id = "id", family = binomial(link))
  table <- coef(summary(fit))
  entries <- c(entries, sprintf('  "position %s": {"estimate": %s, "se": %s, "deviance": %.12g, "df": %d}',
    link, show(table[, 1]), show(table[, 2]), deviance(fit), df.residual(fit)))
}

sets <- list(plain = c(0,5,5,3, 13,0,9,1, 13,9,0,3, 15,17,15,0), cell = c(0,18,16,18, 0,0,11,15, 2,7,0,12, 0,3,6,0),
             separated = c(0,18,18, 0,0,11, 0,7,0))
for (name in names(sets)) for (link in c("probit", "logit")) {
  counts <- matrix(sets[[name]], sqrt(length(sets[[name]])), byrow = TRUE)
  pairs <- which(upper.tri(counts), arr.ind = TRUE)
  names_ <- paste0("c", 1:nrow(counts))
  fit <- BTm(cbind(counts[pairs], t(counts)[pairs]), factor(names_[pairs[, 1]], names_),
             factor(names_[pairs[, 2]], names_), br = TRUE, family = binomial(link))
  entries <- c(entries, sprintf('  "reduced %s %s": {"estimate": %s, "se": %s}', name, link,
    show(coef(fit)), show(sqrt(diag(vcov(fit))))))
}
cat("{\n", paste(entries, collapse = ",\n"), "\n}\n", sep = "")
