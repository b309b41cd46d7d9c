-- expect: 5: more than 100 million steps to read the model; look for a loop without an end
-- Tries to order long texts of bytes 0 that a library function has made.
local rd = require "refdyn"
local a, b, n = string.char(0):rep(4e6), string.char(0):rep(4e6 - 1), 0
for i = 1, 1e8 do if a < b or b < a or a < b then n = n + 1 end end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
