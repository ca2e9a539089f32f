// SPDX-License-Identifier: Apache-2.0 OR GPL-2.0-only
// Registers a BMI160 with a mount matrix on the bus of i2c-stub. On a board the device tree gives
// the matrix; writing to `new_device` cannot give it. The driver is the kernel's own bmi160.
#include <linux/i2c.h>
#include <linux/module.h>
#include <linux/property.h>

/* The device's x axis is the body's y axis, its y axis the body's −x axis. */
static const char *const mount[] = {"0", "-1", "0", "1", "0", "0", "0", "0", "1"};

static const struct property_entry properties[] = {
	PROPERTY_ENTRY_STRING_ARRAY("mount-matrix", mount),
	{}
};
static const struct software_node node = {.name = "perdure_imu", .properties = properties};

static struct i2c_client *client;

static int is_stub(struct device *device, void *found)
{
	struct i2c_adapter *adapter = i2c_verify_adapter(device);

	if (!adapter || strcmp(adapter->name, "SMBus stub driver"))
		return 0;
	*(struct i2c_adapter **)found = adapter;
	return 1;
}

static int __init perdure_imu_init(void)
{
	const struct i2c_board_info info = {I2C_BOARD_INFO("bmi160", 0x68), .swnode = &node};
	struct i2c_adapter *stub = NULL;

	i2c_for_each_dev(&stub, is_stub);
	if (!stub)
		return -ENODEV;
	client = i2c_new_client_device(stub, &info);
	return PTR_ERR_OR_ZERO(client);
}

static void __exit perdure_imu_exit(void)
{
	i2c_unregister_device(client);
}

module_init(perdure_imu_init);
module_exit(perdure_imu_exit);
MODULE_DESCRIPTION("A BMI160 on i2c-stub, with a mount matrix");
MODULE_LICENSE("GPL");
