-- expect: 6: a function is called with more than 250 arguments for `...`; pass them in a table
local rd = require "refdyn"
local t = {}
for i = 1, 300 do t[i] = i end
local function sum(...)
  return select("#", ...)
end
sum(table.unpack(t))
