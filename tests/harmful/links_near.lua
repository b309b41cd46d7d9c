-- Tries as many links as a list may have, in reverse order.
local rd = require "refdyn"
local t, n = {}, 10000
for i = 1, n do t[i] = { "a" .. i, on = i < n and "a" .. i + 1 or nil, joint = "x", mass = 1 } end
return rd.model { name = "harmful", links = t }
