-- expect: 3: error(...) with a value of type table, a text is needed
local rd = require "refdyn"
error({ "text" })
